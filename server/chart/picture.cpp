#include "server/chart/picture.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace bakewell {
namespace {

using Colour = std::array<uint8_t, 3>;

// Hues a golden ratio apart, so that neighbours in number differ.
Colour ColourOf(int32_t chart) {
  const double hue = std::fmod(0.61803398875 * chart, 1.0) * 2 * kPi, light = 0.62 + 0.15 * (chart % 3);
  Colour colour;
  for (int c = 0; c < 3; ++c)
    colour[c] = static_cast<uint8_t>(255 * light * (0.62 + 0.38 * std::cos(hue - 2 * kPi * c / 3)));
  return colour;
}

double Side(TexelUv a, TexelUv b, double x, double y) {
  return (double(b.x) - a.x) * (y - a.y) - (double(b.y) - a.y) * (x - a.x);
}

class Canvas {
 public:
  explicit Canvas(PageSize size) : size_(size), owner_(static_cast<size_t>(size.width) * size.height, kNoChart) {}

  void Draw(const std::array<TexelUv, 3>& t, int32_t chart) {
    const auto [x0, x1] = std::minmax({t[0].x, t[1].x, t[2].x});
    const auto [y0, y1] = std::minmax({t[0].y, t[1].y, t[2].y});
    for (int y = static_cast<int>(y0); y < std::min<int>(static_cast<int>(y1) + 1, size_.height); ++y)
      for (int x = static_cast<int>(x0); x < std::min<int>(static_cast<int>(x1) + 1, size_.width); ++x)
        if (Covers(t, x + 0.5, y + 0.5)) Take(owner_[static_cast<size_t>(y) * size_.width + x], chart);
  }

  std::vector<uint8_t> Rgb() const {
    std::vector<uint8_t> rgb;
    rgb.reserve(3 * owner_.size());
    for (const int32_t owner : owner_) {
      const Colour colour = owner == kNoChart   ? Colour{0, 0, 0}
                            : owner == kMeeting ? Colour{255, 255, 255}
                                                : ColourOf(owner);
      rgb.insert(rgb.end(), colour.begin(), colour.end());
    }
    return rgb;
  }

 private:
  static constexpr int32_t kMeeting = -2;
  static bool Covers(const std::array<TexelUv, 3>& t, double x, double y) {
    return Side(t[0], t[1], x, y) >= 0 && Side(t[1], t[2], x, y) >= 0 && Side(t[2], t[0], x, y) >= 0;
  }
  static void Take(int32_t& owner, int32_t chart) { owner = owner == kNoChart || owner == chart ? chart : kMeeting; }

  PageSize size_;
  std::vector<int32_t> owner_;
};

}  // namespace

std::vector<uint8_t> DrawCharts(const AtlasLayout& layout, int page) {
  Canvas canvas(layout.pages[page]);
  for (const ObjectCharts& object : layout.objects)
    for (size_t t = 0; t < object.chart_of_triangle.size(); ++t) {
      const int32_t chart = object.chart_of_triangle[t];
      if (chart == kNoChart || layout.charts[chart].page != page) continue;
      canvas.Draw(
          {object.uv[object.index[3 * t]], object.uv[object.index[3 * t + 1]], object.uv[object.index[3 * t + 2]]},
          chart);
    }
  return canvas.Rgb();
}

}  // namespace bakewell
