#pragma once

#include <filesystem>
#include <string>

#include "core/base/status.h"
#include "core/image/image.h"

namespace bakewell {

// An EXR file: all channels as 32-bit floats, RLE compressed, single part, top row first. Same bytes for the same
// image.
absl::StatusOr<std::string> ExrBytes(const Image& image);

// ExrBytes as a file that appears whole or not at all (temporary name in the same folder, fsync, rename). kUnavailable
// when the disk refuses.
absl::Status WriteExr(const std::filesystem::path& path, const Image& image);

// Reads every channel of the first part (half, float and uint become float), channels in the file's (alphabetical)
// order. Safe on hostile files. kNotFound, kInvalidArgument with the path and the reason.
absl::StatusOr<Image> ReadExr(const std::filesystem::path& path);

}  // namespace bakewell
