#pragma once

#include <exception>
#include <new>

#include "core/base/status.h"

namespace bakewell {

// What `work()` gives, a Status or StatusOr; or that it threw: kResourceExhausted for want of memory, else kInternal.
// Once per RPC and per task: an input of gigabytes may end the memory, not the program.
template <typename Work>
auto Caught(const Work& work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError("out of memory");
  } catch (const std::exception& error) {
    return absl::InternalError(error.what());
  }
}

}  // namespace bakewell
