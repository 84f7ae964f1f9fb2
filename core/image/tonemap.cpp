#include <algorithm>
#include <cmath>

#include "core/image/png.h"
#include "core/math/vec.h"

namespace bakewell {
namespace {

constexpr float kWhitePoint = 0.8f;  // display value of the 95th percentile; above it the shoulder begins

// Luminances of covered, finite pixels; all finite pixels where the page has no A.
std::vector<float> CoveredLuminances(const Image& image) {
  const int r = image.ChannelIndex("R"), g = image.ChannelIndex("G"), b = image.ChannelIndex("B");
  const int a = image.ChannelIndex("A");
  std::vector<float> values;
  for (size_t i = 0; i < image.PixelCount(); ++i) {
    if (a >= 0 && !(image.Channel(a)[i] > 0)) continue;
    const float y = Luminance(Rgb{image.Channel(r)[i], image.Channel(g)[i], image.Channel(b)[i]});
    if (std::isfinite(y)) values.push_back(y);
  }
  return values;
}

float Exposure(std::vector<float> luminances) {
  if (luminances.empty()) return 1;
  const auto nth = luminances.begin() + static_cast<std::ptrdiff_t>((luminances.size() - 1) * 95 / 100);
  std::nth_element(luminances.begin(), nth, luminances.end());
  return *nth > 0 ? kWhitePoint / *nth : 1;
}

// Identity up to the white point, then an exponential that joins it with the same slope and ends at 1.
float Shoulder(float x) {
  if (x <= kWhitePoint) return x;
  const float room = 1 - kWhitePoint;
  return kWhitePoint + room * (1 - std::exp(-(x - kWhitePoint) / room));
}

// IEC 61966-2-1.
float SrgbFromLinear(float x) { return x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1 / 2.4f) - 0.055f; }

uint8_t DisplayByte(float exposed) {
  const float x = exposed > 0 ? exposed : 0;  // also NaN
  return static_cast<uint8_t>(std::lround(255 * SrgbFromLinear(Shoulder(x))));
}

}  // namespace

std::vector<uint8_t> TonemapPreview(const Image& irradiance) {
  const int channel[3] = {irradiance.ChannelIndex("R"), irradiance.ChannelIndex("G"), irradiance.ChannelIndex("B")};
  for (const int c : channel) BAKEWELL_CHECK_OP(c, >=, 0);
  const float exposure = Exposure(CoveredLuminances(irradiance));
  std::vector<uint8_t> rgb(irradiance.PixelCount() * 3);
  for (size_t i = 0; i < irradiance.PixelCount(); ++i) {
    for (size_t c = 0; c < 3; ++c) rgb[3 * i + c] = DisplayByte(exposure * irradiance.Channel(channel[c])[i]);
  }
  return rgb;
}

}  // namespace bakewell
