#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "core/base/status.h"
#include "core/image/image.h"

namespace bakewell {

// Writes width x height RGB pixels, 8 bits a channel (rgb: 3 * width * height, row 0 on top). Whole or not at all.
absl::Status WritePng(const std::filesystem::path& path, int width, int height, std::span<const uint8_t> rgb);

// The same pixels as the bytes of a PNG file.
absl::StatusOr<std::string> PngBytes(int width, int height, std::span<const uint8_t> rgb);

// Reads any PNG as 8-bit RGBA channels scaled to [0,1], named R G B A. Safe on hostile files.
absl::StatusOr<Image> ReadPng(const std::filesystem::path& path);

// The preview of an irradiance page: channels R, G, B exposed so that the 95th percentile of the luminance of pixels
// with A > 0 maps to 0.8, then an sRGB curve with a soft shoulder. 3 * width * height bytes.
std::vector<uint8_t> TonemapPreview(const Image& irradiance);

}  // namespace bakewell
