#include "core/base/check.h"

#include <cstdio>
#include <cstdlib>

namespace bakewell {

void CheckFailed(const char* file, int line, const std::string& what) {
  std::fprintf(stderr, "%s:%d: check failed: %s\n", file, line, what.c_str());
  std::abort();
}

}  // namespace bakewell
