// How triangles glow: World's emission, by textures, alpha and what coincides.

#include <absl/container/inlined_vector.h>

#include <algorithm>
#include <cmath>

#include "worker/trace/world.h"

namespace bakewell {

bool World::Emits(uint32_t triangle) const { return MaxComponent(MaterialOf(triangles_[triangle]).emission) > 0; }

Rgb World::FrontEmissionAt(uint32_t triangle, float u, float v) const {
  const Triangle& t = triangles_[triangle];
  const Material& material = MaterialOf(t);
  if (material.emission_texture.texture < 0 || MaxComponent(material.emission) <= 0) return material.emission;
  const Vec2f uv = TexcoordAt(t, material.emission_texture.texcoord, u, v);
  return material.emission *
         SampleColor(scene_.textures[material.emission_texture.texture], material.emission_texture, uv);
}

float World::GlowTexelsAcross(uint32_t triangle) const {
  const Triangle& t = triangles_[triangle];
  const Material& material = MaterialOf(t);
  const auto across = [&](const TextureRef& ref) {
    if (ref.texture < 0) return 0.0f;
    const Texture& texture = scene_.textures[ref.texture];
    const auto length = [&](Vec2f d) {
      return std::hypot(d.x * ref.scale.x, d.y * ref.scale.y) *
             static_cast<float>(std::max(texture.width, texture.height));
    };
    const Vec2f corner = TexcoordAt(t, ref.texcoord, 0, 0);
    return std::max(length(TexcoordAt(t, ref.texcoord, 1, 0) - corner),
                    length(TexcoordAt(t, ref.texcoord, 0, 1) - corner));
  };
  const float alpha = material.alpha_mode == AlphaMode::kOpaque ? 0 : across(material.base_texture);
  return std::max(across(material.emission_texture), alpha);
}

Rgb World::EmissionAt(const Hit& hit) const {
  if (hit.back && !MaterialOf(triangles_[hit.triangle]).double_sided) return {};
  return FrontEmissionAt(hit.triangle, hit.u, hit.v);
}

Rgb World::GlowAt(uint32_t triangle, float u, float v, bool back) const {
  if (back && !MaterialOf(triangles_[triangle]).double_sided) return {};
  const float share = ShareMet(triangle, u, v, back);
  return share > 0 ? FrontEmissionAt(triangle, u, v) * share : Rgb{};
}

TexelRange World::TexelsOver(const Triangle& t, const TextureRef& ref, std::span<const Vec2f> points,
                             double most_texels) const {
  absl::InlinedVector<Vec2f, 4> corners;
  for (const Vec2f b : points) corners.push_back(TexcoordAt(t, ref.texcoord, b.x, b.y));
  return RangeOver(scene_.textures[ref.texture], ref, corners, most_texels);
}

std::pair<float, float> World::AlphaOver(const Triangle& t, std::span<const Vec2f> points, double most_texels) const {
  const Material& material = MaterialOf(t);
  if (material.base_texture.texture < 0) return {material.base_alpha, material.base_alpha};
  const TexelRange texels = TexelsOver(t, material.base_texture, points, most_texels);
  return {material.base_alpha * texels.least_alpha, material.base_alpha * texels.most_alpha};
}

GlowRange World::GlowOver(uint32_t triangle, std::span<const Vec2f> points, double most_texels) const {
  const Triangle& t = triangles_[triangle];
  const Material& material = MaterialOf(t);
  GlowRange range{material.emission, material.emission};
  if (material.emission_texture.texture >= 0) {
    const TexelRange texels = TexelsOver(t, material.emission_texture, points, most_texels);
    range = {material.emission * texels.least, material.emission * texels.most};
  }
  if (GroupOf(triangle) != 0) range.least = {};
  if (material.alpha_mode == AlphaMode::kOpaque || MaxComponent(range.most) <= 0) return range;
  auto [least, most] = AlphaOver(t, points, most_texels);
  if (material.alpha_mode == AlphaMode::kMask) {
    least = least >= material.alpha_cutoff + kCutoffRounding ? 1 : 0;
    most = most < material.alpha_cutoff - kCutoffRounding ? 0 : 1;
  }
  return {range.least * std::clamp(least, 0.0f, 1.0f), range.most * std::clamp(most, 0.0f, 1.0f)};
}

GlowInputs World::GlowInputsOf(uint32_t triangle) const {
  const Triangle& t = triangles_[triangle];
  const Material& material = MaterialOf(t);
  GlowInputs inputs{.material = t.material, .coincides = GroupOf(triangle) != 0 ? triangle : kNoTriangle};
  for (size_t i = 0; i < kTriangleCorners.size(); ++i) {
    const auto at_corner = [&](const TextureRef& ref) {
      return ref.texture < 0 ? Vec2f{} : TexcoordAt(t, ref.texcoord, kTriangleCorners[i].x, kTriangleCorners[i].y);
    };
    inputs.emission_uv[i] = at_corner(material.emission_texture);
    if (material.alpha_mode != AlphaMode::kOpaque) inputs.alpha_uv[i] = at_corner(material.base_texture);
  }
  return inputs;
}

}  // namespace bakewell
