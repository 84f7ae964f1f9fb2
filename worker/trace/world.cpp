#include "worker/trace/world.h"

#include <absl/container/flat_hash_map.h>
#include <embree3/rtcore.h>
#include <immintrin.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "core/base/check.h"
#include "worker/sample/hash.h"
#include "worker/trace/coincident.h"

namespace bakewell {

struct World::Device {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  ~Device() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
};

struct World::TraceContext {
  RTCIntersectContext rtc;
  const World* world;
  const Ray* ray;
};

World::World(const Scene& scene, BackfaceMode backfaces, float albedo_limit)
    : scene_(scene), backfaces_(backfaces), albedo_limit_(albedo_limit), device_(std::make_unique<Device>()) {}

World::~World() = default;

absl::StatusOr<std::unique_ptr<World>> World::Build(const Scene& scene, BackfaceMode backfaces, float albedo_limit,
                                                    const SkipSet& no_skip) {
  std::unique_ptr<World> world(new World(scene, backfaces, albedo_limit));
  BAKEWELL_RETURN_IF_ERROR(world->BuildTriangles());
  world->SortByAlpha(!no_skip.Has(Skip::kOpaqueAlpha));
  BAKEWELL_RETURN_IF_ERROR(world->BuildDevice());
  return world;
}

namespace {

// False for triangles without area or with coordinates that are not numbers.
bool MakeTriangle(const Object& object, uint32_t k, Triangle& triangle) {
  const Vec3f p0 = CornerOf(object, k, 0), p1 = CornerOf(object, k, 1), p2 = CornerOf(object, k, 2);
  triangle.p0 = p0;
  triangle.e1 = p1 - p0;
  triangle.e2 = p2 - p0;
  const Vec3d normal = NormalizeOrZero(Cross(ToDouble(triangle.e1), ToDouble(triangle.e2)));
  triangle.normal = ToFloat(normal);
  triangle.index_in_object = k;
  triangle.material = static_cast<uint16_t>(object.material);
  return Dot(normal, normal) > 0.5 && IsFinite(p0) && IsFinite(p1) && IsFinite(p2);
}

bool IsOpaque(const Material& material, BackfaceMode backfaces) {
  return material.alpha_mode == AlphaMode::kOpaque && (backfaces != BackfaceMode::kPass || material.double_sided);
}

constexpr double kMostAlphaTexels = 65536;  // that are looked at to know whether a triangle is opaque

// True where rounding tilts the plane that Embree intersects by more than SurfacePoint::offset allows for: the cross
// product of two edges is off by about 2^-23 |e1| |e2|.
bool IsNeedle(const Triangle& t) {
  constexpr double kMostSlender = 32;
  const double edges = static_cast<double>(Length(t.e1)) * static_cast<double>(Length(t.e2));
  return edges > kMostSlender * Length(Cross(ToDouble(t.e1), ToDouble(t.e2)));
}

}  // namespace

absl::Status World::BuildTriangles() {
  if (scene_.materials.size() > std::numeric_limits<uint16_t>::max()) {
    return absl::InvalidArgumentError("the scene has more than 65,535 materials; merge some");
  }
  size_t total = 0;
  for (const Object& object : scene_.objects) total += object.index.size() / 3;
  if (total >= kNoTriangle) return absl::InvalidArgumentError("the scene has more than 2^32 - 2 triangles; split it");
  triangles_.reserve(total);
  const std::vector<Coincident> coincident = FindCoincident(scene_);
  std::vector<std::pair<uint32_t, uint32_t>> groups;
  for (const bool always_met : {true, false}) {
    uint64_t number = 0;
    auto next = coincident.begin();
    for (uint32_t o = 0; o < scene_.objects.size(); ++o) {
      const Object& object = scene_.objects[o];
      const bool object_opaque = IsOpaque(scene_.materials[object.material], backfaces_);
      for (uint32_t k = 0; k < object.index.size() / 3; ++k, ++number) {
        const bool coincides = next != coincident.end() && next->number == number;
        const uint32_t group = coincides ? (next++)->group : 0;
        Triangle triangle;
        triangle.object = o;
        if (!MakeTriangle(object, k, triangle)) continue;
        if ((object_opaque && !coincides && !IsNeedle(triangle)) != always_met) continue;
        if (coincides) groups.emplace_back(group, triangles_.size());
        triangles_.push_back(triangle);
      }
    }
    if (always_met) opaque_count_ = static_cast<uint32_t>(triangles_.size());
  }
  SortGroups(std::move(groups));
  Vec3d sum;
  for (const Triangle& t : triangles_) sum += ToDouble(t.p0) * 3.0 + ToDouble(t.e1) + ToDouble(t.e2);
  center_ = triangles_.empty() ? Vec3f{} : ToFloat(sum / (3.0 * static_cast<double>(triangles_.size())));
  for (const Triangle& t : triangles_) {
    for (const Vec3f p : {t.p0, t.p0 + t.e1, t.p0 + t.e2}) radius_ = std::max(radius_, Length(p - center_));
  }
  return absl::OkStatus();
}

// A triangle whose alpha lets every ray pass, or none, need not be asked.
void World::SortByAlpha(bool look) {
  absl::flat_hash_map<GlowInputs, std::pair<float, float>> looked_at;  // leaves share texture coordinates
  const auto alpha_of = [&](uint32_t k) {
    const auto [found, is_new] = looked_at.try_emplace(GlowInputsOf(k));
    if (is_new) found->second = AlphaOver(triangles_[k], kTriangleCorners, kMostAlphaTexels);
    return found->second;
  };
  for (uint32_t k = 0; k < triangles_.size(); ++k) {
    const Triangle& t = triangles_[k];
    const Material& material = MaterialOf(t);
    const bool has_alpha = material.alpha_mode != AlphaMode::kOpaque;
    opaque_alpha_.of += has_alpha ? 1 : 0;
    if (k < opaque_count_) {
      of_geometry_[kStops].push_back(k);
      continue;
    }
    const auto members = MembersOf(GroupOf(k));
    const bool hidden = GroupOf(k) != 0 && std::find(members.begin(), members.end(), k) == members.end();
    if (hidden) continue;
    const auto [least, most] = look && has_alpha ? alpha_of(k) : std::pair(0.0f, 1.0f);
    const bool mask = material.alpha_mode == AlphaMode::kMask;
    const bool passes = mask ? most < material.alpha_cutoff - kCutoffRounding : most <= 0;
    const bool stops = !has_alpha || (mask ? least >= material.alpha_cutoff + kCutoffRounding : least >= 1);
    const bool whole =
        stops && (backfaces_ != BackfaceMode::kPass || material.double_sided) && !IsNeedle(t) && members.size() <= 1;
    opaque_alpha_.skipped += has_alpha && (passes || whole) ? 1 : 0;
    if (!passes) of_geometry_[whole ? kStops : kAsks].push_back(k);
  }
}

void World::AddGeometry(Geometry geometry_id) {
  const std::vector<uint32_t>& listed = of_geometry_[geometry_id];
  if (listed.empty()) return;
  const size_t count = listed.size();
  RTCGeometry geometry = rtcNewGeometry(device_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), 3 * count));
  auto* indices = static_cast<uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(uint32_t), count));
  for (size_t k = 0; k < count; ++k) {
    const Triangle& t = triangles_[listed[k]];
    const Object& object = scene_.objects[t.object];
    for (size_t corner = 0; corner < 3; ++corner) {
      const Vec3f p = CornerOf(object, t.index_in_object, corner);
      std::memcpy(vertices + 9 * k + 3 * corner, &p, sizeof p);
      indices[3 * k + corner] = static_cast<uint32_t>(3 * k + corner);
    }
  }
  if (geometry_id == kAsks) {
    rtcSetGeometryIntersectFilterFunction(geometry, &World::Filter);
    rtcSetGeometryOccludedFilterFunction(geometry, &World::Filter);
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(device_->scene, geometry, geometry_id);
  rtcReleaseGeometry(geometry);
}

absl::Status World::BuildDevice() {
  device_->device = rtcNewDevice("isa=avx2");
  if (!device_->device) return absl::InternalError("Embree cannot start: this processor has no AVX2");
  device_->scene = rtcNewScene(device_->device);
  rtcSetSceneFlags(device_->scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(device_->scene, RTC_BUILD_QUALITY_MEDIUM);
  AddGeometry(kStops);
  AddGeometry(kAsks);
  // One thread builds, so that the same scene has the same tree. Embree's own "threads=1" would hold all of TBB to one
  // thread for as long as the process lives.
  tbb::task_arena one_thread(1);
  one_thread.execute([this] { rtcCommitScene(device_->scene); });
  if (rtcGetDeviceError(device_->device) != RTC_ERROR_NONE) {
    return absl::ResourceExhaustedError("Embree could not build its tree: not enough memory for this scene");
  }
  return absl::OkStatus();
}

void World::Filter(const RTCFilterFunctionNArguments* arguments) {
  BAKEWELL_CHECK(arguments->N == 1);
  if (*arguments->valid == 0) return;
  const auto* context = reinterpret_cast<const TraceContext*>(arguments->context);
  const auto* hit = reinterpret_cast<const RTCHit*>(arguments->hit);
  const World& world = *context->world;
  const uint32_t triangle = world.TriangleOf(kAsks, hit->primID), group = world.GroupOf(triangle);
  const Ray& asked = *context->ray;
  const auto is_here = [&](uint32_t end) { return triangle == end || (group != 0 && group == world.GroupOf(end)); };
  if (is_here(asked.from) || is_here(asked.to) || !world.IsMet(triangle, hit->u, hit->v, asked.dir, asked.key)) {
    *arguments->valid = 0;
  }
}

namespace {

// Stored by whole vectors, as Embree loads them: a load that spans several stores waits until all are in the cache.
void Fill(const Ray& ray, RTCRay& query) {
  const Vec3f o = ray.origin, d = ray.dir;
  _mm_store_ps(&query.org_x, _mm_setr_ps(o.x, o.y, o.z, 0));
  _mm_store_ps(&query.dir_x, _mm_setr_ps(d.x, d.y, d.z, 0));
  query.tfar = ray.t_max;
  query.mask = ~0u;
  query.id = query.flags = 0;
}

}  // namespace

Hit World::Intersect(const Ray& ray) const {
  TraceContext context;
  rtcInitIntersectContext(&context.rtc);
  context.world = this;
  context.ray = &ray;
  RTCRayHit query;
  Fill(ray, query.ray);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(device_->scene, &context.rtc, &query);
  Hit hit;
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return hit;
  hit.triangle = TriangleOf(query.hit.geomID, query.hit.primID);
  hit.t = query.ray.tfar;
  hit.u = query.hit.u;
  hit.v = query.hit.v;
  hit.back = Dot(ray.dir, triangles_[hit.triangle].normal) > 0;
  return hit;
}

bool World::Occluded(const Ray& ray) const {
  TraceContext context;
  rtcInitIntersectContext(&context.rtc);
  context.world = this;
  context.ray = &ray;
  RTCRay query;
  Fill(ray, query);
  rtcOccluded1(device_->scene, &context.rtc, &query);
  return query.tfar < 0;
}

void World::VisitNear(Vec3f center, float radius, absl::FunctionRef<bool(uint32_t triangle)> visit) const {
  struct Visit {
    const World* world;
    Vec3f center;
    float square;
    absl::FunctionRef<bool(uint32_t)> visit;
  } found{this, center, radius * radius, visit};
  RTCPointQuery query{};
  query.x = center.x;
  query.y = center.y;
  query.z = center.z;
  query.radius = radius;
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  const auto function = [](RTCPointQueryFunctionArguments* arguments) {
    auto& v = *static_cast<Visit*>(arguments->userPtr);
    const uint32_t triangle = v.world->TriangleOf(arguments->geomID, arguments->primID);
    const Triangle& t = v.world->triangles_[triangle];
    const Vec3f p1 = t.p0 + t.e1, p2 = t.p0 + t.e2;
    float square = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const auto [least, most] = std::minmax({t.p0[axis], p1[axis], p2[axis]});
      const float gap = v.center[axis] - std::clamp(v.center[axis], least, most);
      square += gap * gap;
    }
    if (square > v.square || v.visit(triangle)) return false;
    arguments->query->radius = 0;
    v.square = -1;  // nor those of the same leaf
    return true;
  };
  rtcPointQuery(device_->scene, &query, &context, function, &found);
}

namespace {

float MaxAbs(Vec3f a) { return std::max(std::fabs(a.x), std::max(std::fabs(a.y), std::fabs(a.z))); }

// 2^-24 is half an ulp of 1. p0 + u e1 + v e2 is off by at most about 4 of them per coordinate, the intersection's
// plane by about 8; the rest is margin for grazing starts.
constexpr float kOffsetRelative = 32.0f / 16777216.0f;

}  // namespace

SurfacePoint World::PointAt(uint32_t triangle, float u, float v, bool back) const {
  const Triangle& t = triangles_[triangle];
  SurfacePoint point;
  point.position = t.p0 + t.e1 * u + t.e2 * v;
  point.normal = back ? -t.normal : t.normal;
  point.offset = kOffsetRelative * (MaxAbs(t.p0) + MaxAbs(t.e1) + MaxAbs(t.e2));
  point.triangle = triangle;
  return point;
}

SurfacePoint World::PointAt(const Hit& hit) const { return PointAt(hit.triangle, hit.u, hit.v, hit.back); }

Vec2f World::TexcoordAt(const Triangle& triangle, int set, float u, float v) const {
  const Object& object = scene_.objects[triangle.object];
  const std::vector<Vec2f>& uv = set == 0 ? object.uv0 : object.uv1;
  if (uv.empty()) return {};
  const uint32_t* corner = object.index.data() + 3 * static_cast<size_t>(triangle.index_in_object);
  return uv[corner[0]] * (1 - u - v) + uv[corner[1]] * u + uv[corner[2]] * v;
}

Rgb World::AlbedoAt(const Hit& hit) const {
  const Triangle& t = triangles_[hit.triangle];
  const Material& material = MaterialOf(t);
  if (hit.back && backfaces_ == BackfaceMode::kAbsorb && !material.double_sided) return {};
  Rgb albedo = material.base_color;
  if (material.base_texture.texture >= 0) {
    const Vec2f uv = TexcoordAt(t, material.base_texture.texcoord, hit.u, hit.v);
    albedo = albedo * SampleColor(scene_.textures[material.base_texture.texture], material.base_texture, uv);
  }
  const auto limit = [this](float x) { return std::clamp(x, 0.0f, albedo_limit_); };
  return {limit(albedo.x), limit(albedo.y), limit(albedo.z)};
}

}  // namespace bakewell
