#include "worker/trace/coincident.h"

#include <algorithm>
#include <bit>
#include <tuple>

#include "worker/sample/hash.h"

namespace bakewell {
namespace {

struct Candidate {
  uint32_t hash;  // of the corners in any order
  uint32_t object, k;
};

uint32_t HashOf(Vec3f p) {
  const auto bits = [](float x) { return std::bit_cast<uint32_t>(x + 0.0f); };  // -0 is 0
  return HashCombine(HashCombine(bits(p.x), bits(p.y)), bits(p.z));
}

using Corners = std::array<std::array<float, 3>, 3>;
Corners SortedCorners(const Scene& scene, const Candidate& c) {
  Corners corners;
  for (size_t i = 0; i < 3; ++i) {
    const Vec3f p = CornerOf(scene.objects[c.object], c.k, i);
    corners[i] = {p.x, p.y, p.z};
  }
  std::sort(corners.begin(), corners.end());
  return corners;
}

}  // namespace

std::vector<Coincident> FindCoincident(const Scene& scene) {
  std::vector<Candidate> candidates;
  std::vector<uint64_t> first_of_object;
  uint64_t triangles = 0;
  for (uint32_t o = 0; o < scene.objects.size(); ++o) {
    const Object& object = scene.objects[o];
    const uint32_t count = static_cast<uint32_t>(object.index.size() / 3);
    first_of_object.push_back(triangles);
    triangles += count;
    for (uint32_t k = 0; k < count; ++k) {
      const Vec3f a = CornerOf(object, k, 0), b = CornerOf(object, k, 1), c = CornerOf(object, k, 2);
      if (!IsFinite(a) || !IsFinite(b) || !IsFinite(c)) continue;
      candidates.push_back({HashOf(a) + HashOf(b) + HashOf(c), o, k});
    }
  }
  std::sort(candidates.begin(), candidates.end(), [&](const Candidate& a, const Candidate& b) {
    if (a.hash != b.hash) return a.hash < b.hash;
    const Corners of_a = SortedCorners(scene, a), of_b = SortedCorners(scene, b);
    return std::tie(of_a, a.object, a.k) < std::tie(of_b, b.object, b.k);
  });
  std::vector<Coincident> result;
  uint32_t groups = 0;
  for (size_t begin = 0, end = 0; begin < candidates.size(); begin = end) {
    const auto same = [&](const Candidate& c) {
      return c.hash == candidates[begin].hash && SortedCorners(scene, c) == SortedCorners(scene, candidates[begin]);
    };
    for (end = begin + 1; end < candidates.size() && same(candidates[end]);) ++end;
    if (end == begin + 1) continue;
    for (size_t i = begin; i < end; ++i) {
      result.push_back({first_of_object[candidates[i].object] + candidates[i].k, groups});
    }
    ++groups;
  }
  std::sort(result.begin(), result.end(), [](const Coincident& a, const Coincident& b) { return a.number < b.number; });
  return result;
}

}  // namespace bakewell
