#pragma once

#include <embree3/rtcore.h>

#include <span>
#include <vector>

#include "worker/trace/world.h"

namespace bakewell {

// Rays as Embree was asked about them.
struct RayRecording {
  std::vector<RTCRay> nearest, any;  // rtcIntersect1, rtcOccluded1
};

// While it lives, every ray that this thread gives to Embree is kept. Our own rtcIntersect1 and rtcOccluded1 stand
// before the library's, and cost a test and an indirect call a ray: ours pays for that, not the bare scene.
class RecordRays {
 public:
  explicit RecordRays(RayRecording& recording);
  ~RecordRays();
  RecordRays(const RecordRays&) = delete;
  RecordRays& operator=(const RecordRays&) = delete;
};

// The same triangles in a scene without filter functions, built with the same options, and asked without anything
// around the call.
class BareScene {
 public:
  explicit BareScene(const World& world);
  ~BareScene();
  BareScene(const BareScene&) = delete;
  BareScene& operator=(const BareScene&) = delete;

  // How many of the rays hit something.
  int64_t Nearest(std::span<const RTCRay> rays) const;
  int64_t Any(std::span<const RTCRay> rays) const;
  int64_t NearestInPackets(std::span<const RTCRay> rays) const;  // of eight
  int64_t AnyInPackets(std::span<const RTCRay> rays) const;

 private:
  RTCDevice device_;
  RTCScene scene_;
};

}  // namespace bakewell
