// Which of the triangles at a place a ray meets: World's, by alpha and by the order of those that coincide.

#include <algorithm>

#include "worker/sample/hash.h"
#include "worker/trace/coincident.h"
#include "worker/trace/texture.h"
#include "worker/trace/world.h"

namespace bakewell {

namespace {

// The order among triangles that coincide and turn the same side to a ray.
bool ComesFirst(const World& world, uint32_t a, uint32_t b) {
  const float glow_a = MaxComponent(world.MaterialOf(world.triangles()[a]).emission);
  const float glow_b = MaxComponent(world.MaterialOf(world.triangles()[b]).emission);
  return glow_a != glow_b ? glow_a > glow_b : a < b;
}

// Whether `a`, which comes first, is met from both sides before `b`.
bool Hides(const World& world, uint32_t a, uint32_t b) {
  const Triangle &first = world.triangles()[a], &second = world.triangles()[b];
  const Material& material = world.MaterialOf(first);
  const bool same_sides = Dot(first.normal, second.normal) > 0 && !world.MaterialOf(second).double_sided;
  return material.alpha_mode == AlphaMode::kOpaque && (material.double_sided || same_sides);
}

// The barycentrics on `to`, which coincides with `from`, of a point of `from`.
Vec2f CoincidentPoint(const Scene& scene, const Triangle& from, const Triangle& to, float u, float v) {
  const Object &from_object = scene.objects[from.object], &to_object = scene.objects[to.object];
  const std::array<float, 3> weights{1 - u - v, u, v};
  std::array<float, 3> result{};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      const bool same = CornerOf(from_object, from.index_in_object, i) == CornerOf(to_object, to.index_in_object, j);
      if (same) result[j] = weights[i];
    }
  }
  return {result[1], result[2]};
}

}  // namespace

void World::SortGroups(std::vector<std::pair<uint32_t, uint32_t>> triangles) {
  std::sort(triangles.begin(), triangles.end(), [this](const auto& a, const auto& b) {
    return a.first != b.first ? a.first < b.first : ComesFirst(*this, a.second, b.second);
  });
  group_of_.assign(triangles_.size() - opaque_count_, 0);
  group_begin_.push_back(0);
  std::vector<uint32_t> opaque;  // members of the group
  for (size_t i = 0; i < triangles.size(); ++i) {
    const auto [group, k] = triangles[i];
    group_of_[k - opaque_count_] = static_cast<uint32_t>(group_begin_.size() - 1);
    if (std::none_of(opaque.begin(), opaque.end(), [&](uint32_t other) { return Hides(*this, other, k); })) {
      member_.push_back(k);
      if (MaterialOf(triangles_[k]).alpha_mode == AlphaMode::kOpaque) opaque.push_back(k);
    }
    if (i + 1 < triangles.size() && triangles[i + 1].first == group) continue;
    group_begin_.push_back(static_cast<uint32_t>(member_.size()));
    opaque.clear();
  }
}

// Those that coincide with a triangle and are there before it for rays that come to its front or back: visit(member, u,
// v, back) until it returns false.
template <typename Visit>
void World::VisitBefore(uint32_t triangle, float u, float v, bool back, Visit visit) const {
  const Triangle& t = triangles_[triangle];
  const bool faces = !back || MaterialOf(t).double_sided;
  for (const uint32_t member : MembersOf(GroupOf(triangle))) {
    if (member == triangle) continue;
    const Triangle& other = triangles_[member];
    const bool other_back = back != (Dot(t.normal, other.normal) < 0);
    const bool other_faces = !other_back || MaterialOf(other).double_sided;
    if (faces == other_faces ? !ComesFirst(*this, member, triangle) : faces) continue;
    const Vec2f at = CoincidentPoint(scene_, t, other, u, v);
    if (!visit(member, at.x, at.y, other_back)) return;
  }
}

// The share of rays that a triangle stops where it is alone.
float World::OpacityAt(uint32_t triangle, float u, float v, bool back) const {
  const Triangle& t = triangles_[triangle];
  const Material& material = MaterialOf(t);
  if (backfaces_ == BackfaceMode::kPass && !material.double_sided && back) return 0;
  if (material.alpha_mode == AlphaMode::kOpaque) return 1;
  float alpha = material.base_alpha;
  if (material.base_texture.texture >= 0) {
    const Vec2f uv = TexcoordAt(t, material.base_texture.texcoord, u, v);
    alpha *= SampleAlpha(scene_.textures[material.base_texture.texture], material.base_texture, uv);
  }
  if (material.alpha_mode == AlphaMode::kMask) return alpha < material.alpha_cutoff ? 0.0f : 1.0f;
  return std::clamp(alpha, 0.0f, 1.0f);
}

bool World::Stops(uint32_t triangle, float u, float v, bool back, uint32_t key) const {
  return UnitFloat(HashCombine(key, triangle)) < OpacityAt(triangle, u, v, back);
}

bool World::IsMet(uint32_t triangle, float u, float v, Vec3f dir, uint32_t key) const {
  const bool back = Dot(dir, triangles_[triangle].normal) > 0;
  bool met = Stops(triangle, u, v, back, key);
  if (met) {
    VisitBefore(triangle, u, v, back, [&](uint32_t other, float other_u, float other_v, bool other_back) {
      return met = !Stops(other, other_u, other_v, other_back, key);
    });
  }
  return met;
}

float World::ShareMet(uint32_t triangle, float u, float v, bool back) const {
  if (IsAlwaysMet(triangle)) return 1;
  float share = OpacityAt(triangle, u, v, back);
  VisitBefore(triangle, u, v, back, [&](uint32_t other, float other_u, float other_v, bool other_back) {
    share *= 1 - OpacityAt(other, other_u, other_v, other_back);
    return share > 0;
  });
  return share;
}

}  // namespace bakewell
