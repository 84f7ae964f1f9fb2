#pragma once

#include <grpcpp/support/status.h>

#include "core/base/status.h"

namespace bakewell {

// The same code and message; the codes of the two are numerically equal.
grpc::Status ToGrpc(const absl::Status& status);
absl::Status FromGrpc(const grpc::Status& status);

}  // namespace bakewell
