#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/base/sha256.h"
#include "core/base/status.h"
#include "proto/rpc/channel.h"

namespace bakewell {

// Which of the digests the coordinator lacks, in their order.
absl::StatusOr<std::vector<Digest>> FindMissing(const Connection& connection, const std::vector<Digest>& digests);

// One try each; the caller decides on another. kDataLoss: the bytes were changed on their way.
absl::Status UploadBlob(const Connection& connection, const Digest& digest, std::string_view bytes);

// The whole blob, verified against its digest: kDataLoss if it is not. Goes on where it was after a lost connection,
// up to `tries` times. The bytes are refused above `max_bytes` (kResourceExhausted) before they are held.
absl::StatusOr<std::string> DownloadBlob(const Connection& connection, const Digest& digest, int64_t max_bytes,
                                         int tries);

}  // namespace bakewell
