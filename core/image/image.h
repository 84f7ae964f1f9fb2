#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/check.h"

namespace bakewell {

// Float channels, planar: channel c, row y (row 0 is the top, v = 0), column x at data[(c * height + y) * width + x].
struct Image {
  int width = 0, height = 0;
  std::vector<std::string> channels;  // C names
  std::vector<float> data;            // C * height * width

  Image() = default;
  Image(int width_px, int height_px, std::vector<std::string> names)
      : width(width_px), height(height_px), channels(std::move(names)), data(PixelCount() * channels.size(), 0.0f) {}

  // Index of the channel of that name, or -1.
  int ChannelIndex(std::string_view name) const {
    for (size_t c = 0; c < channels.size(); ++c) {
      if (channels[c] == name) return static_cast<int>(c);
    }
    return -1;
  }

  size_t PixelCount() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
  float& At(int c, int x, int y) { return data[Offset(c, x, y)]; }
  float At(int c, int x, int y) const { return data[Offset(c, x, y)]; }
  std::span<float> Channel(int c) { return {data.data() + PixelCount() * c, PixelCount()}; }
  std::span<const float> Channel(int c) const { return {data.data() + PixelCount() * c, PixelCount()}; }

 private:
  size_t Offset(int c, int x, int y) const {
    return (static_cast<size_t>(c) * height + static_cast<size_t>(y)) * width + static_cast<size_t>(x);
  }
};

}  // namespace bakewell
