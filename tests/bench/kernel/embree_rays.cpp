#include "tests/bench/kernel/embree_rays.h"

#include <dlfcn.h>

#include <cstring>

#include "core/base/check.h"

namespace bakewell {
namespace {

thread_local RayRecording* recording = nullptr;

template <typename Function>
Function NextOf(const char* name) {
  void* const found = dlsym(RTLD_NEXT, name);
  BAKEWELL_CHECK(found != nullptr);
  return reinterpret_cast<Function>(found);
}

using Intersect1 = decltype(&rtcIntersect1);
using Occluded1 = decltype(&rtcOccluded1);
const Intersect1 kIntersect1 = NextOf<Intersect1>("rtcIntersect1");
const Occluded1 kOccluded1 = NextOf<Occluded1>("rtcOccluded1");

constexpr int kPacket = 8;

// Rays [first, first + 8) as a packet; those beyond the end are off.
template <typename Trace>
void ForPackets(std::span<const RTCRay> rays, Trace trace) {
  for (size_t first = 0; first < rays.size(); first += kPacket) {
    alignas(32) RTCRayHit8 packet;
    alignas(32) int valid[kPacket];
    for (int i = 0; i < kPacket; ++i) {
      const size_t at = std::min(first + static_cast<size_t>(i), rays.size() - 1);
      valid[i] = first + static_cast<size_t>(i) < rays.size() ? -1 : 0;
      const RTCRay& ray = rays[at];
      packet.ray.org_x[i] = ray.org_x, packet.ray.org_y[i] = ray.org_y, packet.ray.org_z[i] = ray.org_z;
      packet.ray.dir_x[i] = ray.dir_x, packet.ray.dir_y[i] = ray.dir_y, packet.ray.dir_z[i] = ray.dir_z;
      packet.ray.tnear[i] = 0, packet.ray.tfar[i] = ray.tfar, packet.ray.time[i] = 0;
      packet.ray.mask[i] = ~0u, packet.ray.flags[i] = 0;
      packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID, packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
    trace(valid, packet);
  }
}

}  // namespace

RecordRays::RecordRays(RayRecording& to) { recording = &to; }
RecordRays::~RecordRays() { recording = nullptr; }

BareScene::BareScene(const World& world) : device_(rtcNewDevice("threads=1,isa=avx2")), scene_(rtcNewScene(device_)) {
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_MEDIUM);
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  const size_t count = world.triangles().size();
  auto* vertices = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), 3 * count));
  auto* indices = static_cast<uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(uint32_t), count));
  for (size_t k = 0; k < count; ++k) {
    const Triangle& t = world.triangles()[k];
    const Vec3f corners[3] = {t.p0, t.p0 + t.e1, t.p0 + t.e2};
    std::memcpy(vertices + 9 * k, corners, sizeof corners);
    for (size_t i = 3 * k; i < 3 * k + 3; ++i) indices[i] = static_cast<uint32_t>(i);
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_);
}

BareScene::~BareScene() {
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

int64_t BareScene::Nearest(std::span<const RTCRay> rays) const {
  int64_t hits = 0;
  for (const RTCRay& ray : rays) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRayHit query;
    query.ray = ray;
    query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    kIntersect1(scene_, &context, &query);
    hits += query.hit.geomID != RTC_INVALID_GEOMETRY_ID;
  }
  return hits;
}

int64_t BareScene::Any(std::span<const RTCRay> rays) const {
  int64_t hits = 0;
  for (const RTCRay& ray : rays) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRay query = ray;
    kOccluded1(scene_, &context, &query);
    hits += query.tfar < 0;
  }
  return hits;
}

int64_t BareScene::NearestInPackets(std::span<const RTCRay> rays) const {
  int64_t hits = 0;
  ForPackets(rays, [&](const int* valid, RTCRayHit8& packet) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect8(valid, scene_, &context, &packet);
    for (int i = 0; i < kPacket; ++i) hits += valid[i] != 0 && packet.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
  });
  return hits;
}

int64_t BareScene::AnyInPackets(std::span<const RTCRay> rays) const {
  int64_t hits = 0;
  ForPackets(rays, [&](const int* valid, RTCRayHit8& packet) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded8(valid, scene_, &context, &packet.ray);
    for (int i = 0; i < kPacket; ++i) hits += valid[i] != 0 && packet.ray.tfar[i] < 0;
  });
  return hits;
}

}  // namespace bakewell

void rtcIntersect1(RTCScene scene, RTCIntersectContext* context, RTCRayHit* query) {
  if (bakewell::recording != nullptr) bakewell::recording->nearest.push_back(query->ray);
  bakewell::kIntersect1(scene, context, query);
}

void rtcOccluded1(RTCScene scene, RTCIntersectContext* context, RTCRay* query) {
  if (bakewell::recording != nullptr) bakewell::recording->any.push_back(*query);
  bakewell::kOccluded1(scene, context, query);
}
