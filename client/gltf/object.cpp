#include "client/gltf/object.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numeric>
#include <string_view>
#include <unordered_set>

namespace bakewell::gltf {
namespace {

// A triangle is degenerate where twice its area is below this share of its longest edge's square: positions are floats,
// so what is thinner has no direction. And below 10^-30 m^2, where float products underflow.
constexpr double kThinnest = 1e-9, kSmallestArea2_m2 = 1e-30;

bool Usable(Vec3d p) {
  return IsFinite(p) && std::abs(p.x) <= MeanPoint::kCoordinateLimit_m &&
         std::abs(p.y) <= MeanPoint::kCoordinateLimit_m && std::abs(p.z) <= MeanPoint::kCoordinateLimit_m;
}

// `values` at each of `index`; empty stays empty.
template <typename T>
std::vector<T> Gather(const std::vector<T>& values, const std::vector<uint32_t>& index) {
  std::vector<T> gathered;
  if (values.empty()) return gathered;
  gathered.reserve(index.size());
  for (const uint32_t i : index) gathered.push_back(values[i]);
  return gathered;
}

PrimitiveData Unshare(const PrimitiveData& data) {
  PrimitiveData unshared;
  unshared.position = Gather(data.position, data.index);
  unshared.uv0 = Gather(data.uv0, data.index);
  unshared.uv1 = Gather(data.uv1, data.index);
  unshared.index.resize(data.index.size());
  std::iota(unshared.index.begin(), unshared.index.end(), 0u);
  return unshared;
}

void MarkTriangles(WorldObject& world) {
  const auto& index = world.object.index;
  world.bad_triangle.resize(index.size() / 3);
  world.live_vertex.resize(world.position_ws.size());
  for (size_t t = 0; t < world.bad_triangle.size(); ++t) {
    const auto corners = std::span(index).subspan(3 * t, 3);
    const bool usable =
        std::all_of(corners.begin(), corners.end(), [&](uint32_t i) { return Usable(world.position_ws[i]); });
    world.bad_triangle[t] = !usable;
    for (const uint32_t i : corners) world.live_vertex[i] = world.live_vertex[i] || usable;
  }
}

// cross(b - a, c - a), from float positions in double precision.
Vec3d AreaVector(const Object& object, size_t triangle) {
  const Vec3d a = ToDouble(object.position[object.index[3 * triangle]]);
  return Cross(ToDouble(object.position[object.index[3 * triangle + 1]]) - a,
               ToDouble(object.position[object.index[3 * triangle + 2]]) - a);
}

bool Degenerate(const Object& object, size_t triangle) {
  double longest2 = 0;
  for (size_t k = 0; k < 3; ++k) {
    const Vec3d edge = ToDouble(object.position[object.index[3 * triangle + k]]) -
                       ToDouble(object.position[object.index[3 * triangle + (k + 1) % 3]]);
    longest2 = std::max(longest2, Dot(edge, edge));
  }
  const double area2 = Length(AreaVector(object, triangle));
  return !(area2 > kThinnest * longest2 && area2 > kSmallestArea2_m2);
}

// The corners' positions, the smallest first and the order around kept: equal for triangles that coincide with the same
// front.
using TriangleKey = std::array<float, 9>;
TriangleKey KeyOf(const Object& object, size_t triangle) {
  std::array<TriangleKey, 3> turns;
  for (size_t turn = 0; turn < 3; ++turn) {
    for (size_t k = 0; k < 3; ++k) {
      const Vec3f p = object.position[object.index[3 * triangle + (turn + k) % 3]];
      // Adding zero makes -0 equal to 0, also as bytes.
      for (size_t axis = 0; axis < 3; ++axis) turns[turn][3 * k + axis] = p[static_cast<int>(axis)] + 0.0f;
    }
  }
  return *std::min_element(turns.begin(), turns.end());
}

struct KeyHash {
  size_t operator()(const TriangleKey& key) const {
    return std::hash<std::string_view>()({reinterpret_cast<const char*>(key.data()), sizeof(key)});
  }
};

void Collapse(Object& object, size_t triangle) {
  object.index[3 * triangle + 1] = object.index[3 * triangle + 2] = object.index[3 * triangle];
}

void CollapseBadTriangles(WorldObject& world) {
  Object& object = world.object;
  std::unordered_set<TriangleKey, KeyHash> seen;
  for (size_t t = 0; t < world.bad_triangle.size(); ++t) {
    const bool bad = world.bad_triangle[t];
    const bool degenerate = !bad && Degenerate(object, t);
    const bool duplicate = !bad && !degenerate && !seen.insert(KeyOf(object, t)).second;
    world.report.non_finite += bad;
    world.report.degenerate += degenerate;
    world.report.duplicate += duplicate;
    if (bad || degenerate || duplicate) Collapse(object, t);
  }
}

// Area-weighted mean normal of the triangles around each vertex.
std::vector<Vec3d> GeometricNormals(const Object& object) {
  std::vector<Vec3d> normals(object.position.size());
  for (size_t t = 0; t < object.index.size() / 3; ++t) {
    const Vec3d area = AreaVector(object, t);
    for (size_t k = 0; k < 3; ++k) normals[object.index[3 * t + k]] += area;
  }
  return normals;
}

void FillNormals(WorldObject& world) {
  Object& object = world.object;
  const std::vector<Vec3d> geometric = GeometricNormals(object);
  object.normal.resize(geometric.size());
  for (size_t i = 0; i < geometric.size(); ++i) {
    Vec3d normal = world.normal_ws.empty() ? Vec3d{} : NormalizeOrZero(world.normal_ws[i]);
    const bool missing = normal == Vec3d{};
    world.report.bad_normals += missing && !world.normal_ws.empty();
    if (missing) normal = NormalizeOrZero(geometric[i]);
    // A vertex that no triangle uses.
    if (normal == Vec3d{}) normal = {0, 1, 0};
    object.normal[i] = ToFloat(normal);
  }
}

}  // namespace

WorldObject PlaceObject(const PrimitiveData& data, const Transform& world_from_mesh) {
  const PrimitiveData mesh = data.normal.empty() ? Unshare(data) : data;
  WorldObject world;
  world.object.index = mesh.index;
  world.object.uv0 = mesh.uv0.empty() ? std::vector<Vec2f>(mesh.position.size()) : mesh.uv0;
  world.object.uv1 = mesh.uv1;
  for (const Vec3d& p : mesh.position) world.position_ws.push_back(world_from_mesh.Point(p));
  for (const Vec3d& n : mesh.normal) world.normal_ws.push_back(world_from_mesh.Normal(n));
  for (size_t t = 0; world_from_mesh.Mirrors() && t < mesh.index.size() / 3; ++t) {
    std::swap(world.object.index[3 * t + 1], world.object.index[3 * t + 2]);
  }
  world.report.triangles = static_cast<int64_t>(mesh.index.size() / 3);
  world.report.bad_uvs = data.bad_uvs;
  MarkTriangles(world);
  return world;
}

void AddTo(MeanPoint& mean, const WorldObject& object) {
  for (size_t i = 0; i < object.position_ws.size(); ++i) {
    if (object.live_vertex[i]) mean.Add(object.position_ws[i]);
  }
}

void FinishObject(WorldObject& world, Vec3d origin_ws) {
  world.object.position.reserve(world.position_ws.size());
  for (size_t i = 0; i < world.position_ws.size(); ++i) {
    world.object.position.push_back(world.live_vertex[i] ? ToFloat(world.position_ws[i] - origin_ws) : Vec3f{});
  }
  CollapseBadTriangles(world);
  FillNormals(world);
}

}  // namespace bakewell::gltf
