#include "worker/trace/texture.h"

#include <array>
#include <cmath>

namespace bakewell {
namespace {

float DecodeSrgb(int value) {
  const double c = value / 255.0;
  return static_cast<float>(c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4));
}

const std::array<float, 256> kSrgb = [] {
  std::array<float, 256> table{};
  for (int i = 0; i < 256; ++i) table[i] = DecodeSrgb(i);
  return table;
}();

Vec2f Transform(const TextureRef& ref, Vec2f uv) {
  const Vec2f scaled{uv.x * ref.scale.x, uv.y * ref.scale.y};
  const float c = std::cos(ref.rotation_rad), s = std::sin(ref.rotation_rad);
  return {ref.offset.x + c * scaled.x + s * scaled.y, ref.offset.y - s * scaled.x + c * scaled.y};
}

int Wrap(int i, int size, WrapMode mode) {
  if (mode == WrapMode::kClampToEdge) return std::clamp(i, 0, size - 1);
  const int period = mode == WrapMode::kRepeat ? size : 2 * size;
  const int m = ((i % period) + period) % period;
  return m < size ? m : period - 1 - m;
}

const uint8_t* TexelAt(const Texture& texture, int x, int y) {
  const size_t column = static_cast<size_t>(Wrap(x, texture.width, texture.wrap_u));
  const size_t row = static_cast<size_t>(Wrap(y, texture.height, texture.wrap_v));
  return texture.rgba.data() + 4 * (row * static_cast<size_t>(texture.width) + column);
}

// Brings a coordinate into a range whose texel index fits an int, whatever the wrap mode.
float Bound(float u, WrapMode mode) {
  if (!std::isfinite(u)) return 0;
  if (mode == WrapMode::kClampToEdge) return std::clamp(u, 0.0f, 1.0f);
  return u - 2.0f * std::floor(0.5f * u);
}

// Calls add(texel, weight) for the texels under the filter.
template <typename Add>
void Filter(const Texture& texture, const TextureRef& ref, Vec2f uv, Add add) {
  if (texture.width <= 0 || texture.height <= 0) return;
  const Vec2f p = Transform(ref, uv);
  const float x = Bound(p.x, texture.wrap_u) * static_cast<float>(texture.width);
  const float y = Bound(p.y, texture.wrap_v) * static_cast<float>(texture.height);
  if (texture.nearest) {
    add(TexelAt(texture, static_cast<int>(std::floor(x)), static_cast<int>(std::floor(y))), 1.0f);
    return;
  }
  const float fx = std::floor(x - 0.5f), fy = std::floor(y - 0.5f);
  const float wx = x - 0.5f - fx, wy = y - 0.5f - fy;
  const int ix = static_cast<int>(fx), iy = static_cast<int>(fy);
  add(TexelAt(texture, ix, iy), (1 - wx) * (1 - wy));
  add(TexelAt(texture, ix + 1, iy), wx * (1 - wy));
  add(TexelAt(texture, ix, iy + 1), (1 - wx) * wy);
  add(TexelAt(texture, ix + 1, iy + 1), wx * wy);
}

}  // namespace

Rgb SampleColor(const Texture& texture, const TextureRef& ref, Vec2f uv) {
  Rgb sum;
  Filter(texture, ref, uv, [&](const uint8_t* texel, float weight) {
    sum += Rgb{kSrgb[texel[0]], kSrgb[texel[1]], kSrgb[texel[2]]} * weight;
  });
  return sum;
}

namespace {

// Calls visit(texel) for all within `margin` texels of the bounding box of some texture coordinates. False, without a
// call, where those are more than `most`, or too far away.
template <typename Visit>
bool VisitAround(const Texture& texture, const TextureRef& ref, std::span<const Vec2f> corners, float margin,
                 double most, Visit visit) {
  constexpr float kFarthest = 1 << 20;  // texels; beyond, their numbers are not exact
  const Vec2f size{static_cast<float>(texture.width), static_cast<float>(texture.height)};
  Vec2f low{kFarthest, kFarthest}, high = low * -1.0f;
  for (const Vec2f corner : corners) {
    const Vec2f p = Transform(ref, corner);
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) return false;
    low = {std::min(low.x, p.x * size.x - margin), std::min(low.y, p.y * size.y - margin)};
    high = {std::max(high.x, p.x * size.x + margin), std::max(high.y, p.y * size.y + margin)};
  }
  if (low.x < -kFarthest || low.y < -kFarthest || high.x > kFarthest || high.y > kFarthest) return false;
  if (static_cast<double>(high.x - low.x) * static_cast<double>(high.y - low.y) > most) return false;
  const int x_end = static_cast<int>(std::floor(high.x)) + 1, y_end = static_cast<int>(std::floor(high.y)) + 1;
  for (int y = static_cast<int>(std::floor(low.y)); y < y_end; ++y) {
    for (int x = static_cast<int>(std::floor(low.x)); x < x_end; ++x) visit(TexelAt(texture, x, y));
  }
  return true;
}

}  // namespace

TexelBound MostOver(const Texture& texture, const TextureRef& ref, std::span<const Vec2f> corners) {
  if (texture.width <= 0 || texture.height <= 0) return {{0, 0, 0}, 0};
  constexpr float kRounding = 0.05f;  // texels: 2^-24 of a coordinate of 2^20, nearly
  std::array<uint8_t, 4> most{};
  const auto visit = [&](const uint8_t* texel) {
    for (size_t c = 0; c < 4; ++c) most[c] = std::max(most[c], texel[c]);
  };
  if (!VisitAround(texture, ref, corners, kRounding + (texture.nearest ? 0.0f : 0.5f), 256, visit)) return {};
  return {{kSrgb[most[0]], kSrgb[most[1]], kSrgb[most[2]]}, static_cast<float>(most[3]) / 255.0f};
}

std::pair<float, float> AlphaRange(const Texture& texture, const TextureRef& ref, const std::array<Vec2f, 3>& corners) {
  constexpr float kMargin = 2;  // texels: the filter's reach and rounding
  if (texture.width <= 0 || texture.height <= 0) return {0, 0};
  uint8_t least = 255, most = 0;
  const auto visit = [&](const uint8_t* texel) {
    least = std::min(least, texel[3]);
    most = std::max(most, texel[3]);
  };
  if (!VisitAround(texture, ref, corners, kMargin, 65536, visit)) return {0, 1};
  return {static_cast<float>(least) / 255.0f, static_cast<float>(most) / 255.0f};
}

float SampleAlpha(const Texture& texture, const TextureRef& ref, Vec2f uv) {
  float sum = 0;
  Filter(texture, ref, uv,
         [&](const uint8_t* texel, float weight) { sum += static_cast<float>(texel[3]) / 255.0f * weight; });
  return sum;
}

}  // namespace bakewell
