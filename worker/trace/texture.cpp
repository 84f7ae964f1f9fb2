#include "worker/trace/texture.h"

#include <immintrin.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

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
  if (ref.rotation_rad == 0) return ref.offset + scaled;
  const float c = std::cos(ref.rotation_rad), s = std::sin(ref.rotation_rad);
  return {ref.offset.x + c * scaled.x + s * scaled.y, ref.offset.y - s * scaled.x + c * scaled.y};
}

// The column or row that texel number `i` of an endless texture is.
size_t Wrap(int i, int size, WrapMode mode) {
  if (i < 0 || i >= size) {
    if (mode == WrapMode::kClampToEdge) return static_cast<size_t>(std::clamp(i, 0, size - 1));
    const int period = mode == WrapMode::kRepeat ? size : 2 * size;
    i %= period;
    if (i < 0) i += period;
    if (i >= size) i = period - 1 - i;
  }
  return static_cast<size_t>(i);
}

const uint8_t* TexelAt(const Texture& texture, size_t column, size_t row) {
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
  const auto column = [&](int i) { return Wrap(i, texture.width, texture.wrap_u); };
  const auto row = [&](int i) { return Wrap(i, texture.height, texture.wrap_v); };
  if (texture.nearest) {
    add(TexelAt(texture, column(static_cast<int>(std::floor(x))), row(static_cast<int>(std::floor(y)))), 1.0f);
    return;
  }
  const float fx = std::floor(x - 0.5f), fy = std::floor(y - 0.5f);
  const float wx = x - 0.5f - fx, wy = y - 0.5f - fy;
  const size_t x0 = column(static_cast<int>(fx)), x1 = column(static_cast<int>(fx) + 1);
  const size_t y0 = row(static_cast<int>(fy)), y1 = row(static_cast<int>(fy) + 1);
  add(TexelAt(texture, x0, y0), (1 - wx) * (1 - wy));
  add(TexelAt(texture, x1, y0), wx * (1 - wy));
  add(TexelAt(texture, x0, y1), (1 - wx) * wy);
  add(TexelAt(texture, x1, y1), wx * wy);
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

struct TexelBox {
  int x_begin = 0, x_end = 0, y_begin = 0, y_end = 0;
};

// The texels that the filter reaches from the bounding box of some texture coordinates; none where those are more than
// `most`, or so far away that rounding reaches beyond a quarter of a texel.
std::optional<TexelBox> BoxAround(const Texture& texture, const TextureRef& ref, std::span<const Vec2f> corners,
                                  double most) {
  constexpr float kRounding = 0x1p-21f;  // interpolation, transform and scaling: eight roundings
  const Vec2f size{static_cast<float>(texture.width), static_cast<float>(texture.height)};
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Vec2f low{kInfinity, kInfinity}, high{-kInfinity, -kInfinity};
  float greatest = 2;  // of what is added up to a coordinate [textures]; where it is wrapped to is below 2
  for (const Vec2f corner : corners) {
    const Vec2f p = Transform(ref, corner);
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) return std::nullopt;
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    greatest = std::max(greatest, std::fabs(corner.x * ref.scale.x) + std::fabs(corner.y * ref.scale.y) +
                                      std::fabs(ref.offset.x) + std::fabs(ref.offset.y));
  }
  const float rounding = kRounding * greatest * std::max(size.x, size.y);
  if (!(rounding < 0.25f)) return std::nullopt;
  const float reach = rounding + (texture.nearest ? 0.0f : 0.5f);
  const auto floor = [](float x) { return static_cast<int>(std::floor(x)); };
  const TexelBox box{floor(low.x * size.x - reach), floor(high.x * size.x + reach) + 1, floor(low.y * size.y - reach),
                     floor(high.y * size.y + reach) + 1};
  const double texels = static_cast<double>(box.x_end - box.x_begin) * static_cast<double>(box.y_end - box.y_begin);
  return texels <= most ? std::optional(box) : std::nullopt;
}

// Least and greatest of each channel, eight texels at a time where they lie side by side.
class Extremes {
 public:
  void Add(const uint8_t* texels, int count) {
    for (; count >= 8; count -= 8, texels += 32) {
      AddEight(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(texels)));
    }
    for (; count > 0; --count, texels += 4) {
      int texel;
      std::memcpy(&texel, texels, sizeof texel);
      AddEight(_mm256_set1_epi32(texel));
    }
  }
  using Texel = std::array<uint8_t, 4>;
  std::pair<Texel, Texel> Get() const {
    Texel least{255, 255, 255, 255}, most{};
    std::array<uint8_t, 32> all_least, all_most;
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(all_least.data()), least_);
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(all_most.data()), most_);
    for (size_t i = 0; i < all_least.size(); ++i) {
      least[i % 4] = std::min(least[i % 4], all_least[i]);
      most[i % 4] = std::max(most[i % 4], all_most[i]);
    }
    return {least, most};
  }

 private:
  void AddEight(__m256i texels) {
    least_ = _mm256_min_epu8(least_, texels);
    most_ = _mm256_max_epu8(most_, texels);
  }
  __m256i least_ = _mm256_set1_epi8(-1), most_ = _mm256_setzero_si256();
};

}  // namespace

TexelRange RangeOver(const Texture& texture, const TextureRef& ref, std::span<const Vec2f> corners,
                     double most_texels) {
  if (texture.width <= 0 || texture.height <= 0) return {.most = {}, .most_alpha = 0};
  const std::optional<TexelBox> box = BoxAround(texture, ref, corners, most_texels);
  if (!box) return {};
  Extremes extremes;
  for (int y = box->y_begin; y < box->y_end; ++y) {
    const size_t row = Wrap(y, texture.height, texture.wrap_v);
    if (box->x_begin >= 0 && box->x_end <= texture.width) {
      extremes.Add(TexelAt(texture, static_cast<size_t>(box->x_begin), row), box->x_end - box->x_begin);
      continue;
    }
    for (int x = box->x_begin; x < box->x_end; ++x) {
      extremes.Add(TexelAt(texture, Wrap(x, texture.width, texture.wrap_u), row), 1);
    }
  }
  const auto [least, most] = extremes.Get();
  const auto color = [](const std::array<uint8_t, 4>& texel) {
    return Rgb{kSrgb[texel[0]], kSrgb[texel[1]], kSrgb[texel[2]]};
  };
  const auto alpha = [](const std::array<uint8_t, 4>& texel) { return static_cast<float>(texel[3]) / 255.0f; };
  return {color(least), color(most), alpha(least), alpha(most)};
}

float SampleAlpha(const Texture& texture, const TextureRef& ref, Vec2f uv) {
  float sum = 0;
  Filter(texture, ref, uv,
         [&](const uint8_t* texel, float weight) { sum += static_cast<float>(texel[3]) / 255.0f * weight; });
  return sum;
}

}  // namespace bakewell
