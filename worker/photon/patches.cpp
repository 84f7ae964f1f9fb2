#include "worker/photon/patches.h"

#include <algorithm>
#include <bit>
#include <tuple>

#include "worker/sample/hash.h"

namespace bakewell {
namespace {

constexpr float kCosPatch = 0.8191520f;  // cos 35 degrees

// The position's bits, with -0 folded into 0.
std::tuple<uint32_t, uint32_t, uint32_t> Bits(Vec3f p) {
  const auto bits = [](float x) { return std::bit_cast<uint32_t>(x + 0.0f); };
  return {bits(p.x), bits(p.y), bits(p.z)};
}

// One number per distinct position: 3 per triangle.
std::vector<uint32_t> WeldCorners(const World& world) {
  struct Corner {
    std::tuple<uint32_t, uint32_t, uint32_t> key;
    uint32_t corner;
  };
  std::vector<Corner> corners;
  const auto& triangles = world.triangles();
  corners.reserve(3 * triangles.size());
  for (uint32_t k = 0; k < triangles.size(); ++k) {
    const Object& object = world.scene().objects[triangles[k].object];
    for (uint32_t i = 0; i < 3; ++i) {
      const Vec3f p = object.position[object.index[3 * static_cast<size_t>(triangles[k].index_in_object) + i]];
      corners.push_back({Bits(p), 3 * k + i});
    }
  }
  std::sort(corners.begin(), corners.end(),
            [](const Corner& a, const Corner& b) { return std::tie(a.key, a.corner) < std::tie(b.key, b.corner); });
  std::vector<uint32_t> vertex(corners.size());
  uint32_t next = 0;
  for (size_t i = 0; i < corners.size(); ++i) {
    if (i > 0 && corners[i].key != corners[i - 1].key) ++next;
    vertex[corners[i].corner] = next;
  }
  return vertex;
}

constexpr uint32_t kNone = ~0u;

// neighbour[3 * k + i]: the triangle across edge i (corner i to i + 1) of triangle k, or kNone.
std::vector<uint32_t> FindNeighbours(const std::vector<uint32_t>& vertex) {
  struct Edge {
    uint32_t low, high, half;
    bool forward;
  };
  std::vector<Edge> edges;
  edges.reserve(vertex.size());
  for (uint32_t half = 0; half < vertex.size(); ++half) {
    const uint32_t a = vertex[half], b = vertex[half % 3 == 2 ? half - 2 : half + 1];
    if (a != b) edges.push_back({std::min(a, b), std::max(a, b), half, a < b});
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return std::tie(a.low, a.high, a.half) < std::tie(b.low, b.high, b.half);
  });
  std::vector<uint32_t> neighbour(vertex.size(), kNone);
  for (size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    while (end < edges.size() && edges[end].low == edges[begin].low && edges[end].high == edges[begin].high) ++end;
    if (end - begin != 2 || edges[begin].forward == edges[begin + 1].forward) continue;
    neighbour[edges[begin].half] = edges[begin + 1].half / 3;
    neighbour[edges[begin + 1].half] = edges[begin].half / 3;
  }
  return neighbour;
}

}  // namespace

std::vector<std::vector<uint32_t>> GrowPatches(const World& world) {
  const std::vector<uint32_t> neighbour = FindNeighbours(WeldCorners(world));
  const auto& triangles = world.triangles();
  std::vector<bool> taken(triangles.size(), false);
  std::vector<std::vector<uint32_t>> patches;
  for (uint32_t seed = 0; seed < triangles.size(); ++seed) {
    if (taken[seed]) continue;
    taken[seed] = true;
    std::vector<uint32_t> patch{seed};
    for (size_t head = 0; head < patch.size(); ++head) {
      for (uint32_t i = 0; i < 3; ++i) {
        const uint32_t next = neighbour[3 * static_cast<size_t>(patch[head]) + i];
        if (next == kNone || taken[next] || Dot(triangles[next].normal, triangles[seed].normal) < kCosPatch) continue;
        taken[next] = true;
        patch.push_back(next);
      }
    }
    patches.push_back(std::move(patch));
  }
  return patches;
}

}  // namespace bakewell
