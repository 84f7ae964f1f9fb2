#include "worker/photon/emit.h"

#include <atomic>
#include <cmath>
#include <limits>

#include "core/base/check.h"
#include "worker/sample/sobol.h"
#include "worker/sample/warp.h"

namespace bakewell {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// A photon as it leaves its light.
struct Photon {
  Vec3f origin, dir;
  Rgb flux;  // [W]
  uint32_t key = 0;
  uint32_t from = kNoTriangle;
};

// Points on spot cones with a density that follows the falloff: the flat part, then the smooth rim by its cubic CDF.
float SpotCosine(const PunctualLight& light, float u) {
  const float flat = 1 - light.cos_inner, rim = (light.cos_inner - light.cos_outer) / 3;
  const float x = u * (flat + rim);
  if (x < flat) return 1 - x;
  return light.cos_outer + (light.cos_inner - light.cos_outer) * std::cbrt(1 - (x - flat) / std::max(rim, 1e-20f));
}

Photon FromPunctual(const PunctualLight& light, Vec2f u, double photons) {
  const Frame frame = FrameFromHint(light.direction, light.tangent);
  if (light.type == LightType::kPoint) {
    return {light.position, frame.ToWorld(UniformSphere(u)), light.intensity * static_cast<float>(4 * kPi / photons),
            0};
  }
  const float flat = 1 - light.cos_inner, rim = (light.cos_inner - light.cos_outer) / 3;
  return {light.position, frame.ToWorld(DirectionFromCosine(SpotCosine(light, u.x), u.y)),
          light.intensity * static_cast<float>(2 * kPi * static_cast<double>(flat + rim) / photons), 0};
}

Photon FromTriangle(const LightSet& lights, const EmissiveTriangle& light, Vec2f u_position, Vec2f u_direction,
                    float u_side, double photons) {
  const World& world = lights.world();
  const Triangle& t = world.triangles()[light.triangle];
  const EmissionTable* table = lights.TableOf(light);
  const auto [b, pdf] = table ? table->Draw(u_position) : EmissionTable::Sample{TriangleFromSquare(u_position)};
  const bool back = light.two_sided && u_side < 0.5f;
  const SurfacePoint point = world.PointAt(light.triangle, b.x, b.y, back);
  const Frame frame = FrameFromHint(point.normal, t.e1);
  const double sides = light.two_sided ? 2 : 1;
  return {RayOrigin(point), frame.ToWorld(CosineHemisphere(u_direction)),
          world.GlowAt(light.triangle, b.x, b.y, back) *
              (static_cast<float>(kPi * static_cast<double>(light.area) * sides / photons) / pdf),
          0, light.triangle};
}

// A photon that crosses the square of side 2R behind the scene at `point`.
Photon FromSquare(const World& world, const Frame& frame, const EmissionGuide::SquarePoint& point, Rgb per_area,
                  double photons) {
  const float r = world.radius();
  const float area = 4 * r * r;
  const Vec3f on_square = world.center() + frame.t * (point.position.x * r) + frame.b * (point.position.y * r);
  return {on_square + frame.n * (2 * r), -frame.n,
          per_area * static_cast<float>(area / (static_cast<double>(point.density) * photons)), 0};
}

class Emitter {
 public:
  Emitter(const World& world, const LightSet& lights, const EmissionGuide& guide, const PhotonPlan& plan)
      : world_(world), lights_(lights), guide_(guide), plan_(plan) {}

  Photon Emit(const PhotonSource& source, const SobolPoint& u, int64_t photon) const {
    Photon result = Draw(source, u);
    result.key = HashCombine(HashCombine(plan_.seed, 0x9107u), HashWide(static_cast<uint64_t>(photon)));
    return result;
  }

 private:
  Photon Draw(const PhotonSource& source, const SobolPoint& u) const {
    const double n = static_cast<double>(source.count);
    if (source.kind == PhotonSource::Kind::kDirectional) {
      const LightSample sun = lights_.SampleDirectional(source.light, u.Get2(2));
      Frame frame = SunFrame(lights_.directionals()[source.light]);
      const auto point = guide_.DrawSun(source.light, u.Get2(0));
      Photon photon = FromSquare(world_, frame, point, lights_.directionals()[source.light].intensity, n);
      photon.origin += (sun.dir - frame.n) * (2 * world_.radius());
      photon.dir = -sun.dir;
      return photon;
    }
    if (source.kind == PhotonSource::Kind::kSky) {
      const auto sky = guide_.DrawSky(u.Get2(2), u.Get2(0));
      return FromSquare(world_, sky.across, sky.point, lights_.environment().Radiance(sky.dir) / sky.pdf, n);
    }
    if (!lights_.IsEmissive(source.light)) return FromPunctual(lights_.locals()[source.light], u.Get2(0), n);
    const EmissiveTriangle& triangle = lights_.emissive()[static_cast<size_t>(source.light) - lights_.locals().size()];
    return FromTriangle(lights_, triangle, u.Get2(2), u.Get2(0), u.Get(7), n);
  }

  const World& world_;
  const LightSet& lights_;
  const EmissionGuide& guide_;
  const PhotonPlan& plan_;
};

void AddTo(int64_t& sum, int64_t value) { std::atomic_ref<int64_t>(sum).fetch_add(value, std::memory_order_relaxed); }

using Fixed = std::array<int64_t, 3>;

// Traces photons and deposits them.
class Tracer {
 public:
  Tracer(const World& world, const SurfaceCells& cells, double scale, PhotonMap& map)
      : world_(world), cells_(cells), scale_(scale), map_(map) {}

  void Trace(const Photon& photon, const SobolPoint& u, int group) {
    Ray ray{photon.origin, photon.dir, kInfinity, photon.key, photon.from};
    Rgb flux = photon.flux;
    Fixed fixed = ToFixed(flux);
    Accumulate(totals_.emitted, fixed);
    for (int bounce = 0;; ++bounce) {
      ++totals_.rays;
      const Hit hit = world_.Intersect(ray);
      if (!hit) return Accumulate(totals_.escaped, fixed);
      const SurfacePoint point = world_.PointAt(hit);
      Deposit(hit, point, fixed, ToFixed(Luminance(flux)), group);
      const Rgb albedo = world_.AlbedoAt(hit);
      const float survive = MaxComponent(albedo);
      if (bounce + 1 == kMaxPhotonBounces) ++totals_.cut_paths;
      if (Random(photon, u, bounce, 2) >= survive || bounce + 1 == kMaxPhotonBounces) {
        return Accumulate(totals_.absorbed, fixed);
      }
      flux = flux * albedo / survive;
      const Fixed after = ToFixed(flux);
      Accumulate(totals_.absorbed, {fixed[0] - after[0], fixed[1] - after[1], fixed[2] - after[2]});
      fixed = after;
      const Frame frame = FrameFromHint(point.normal, world_.triangles()[hit.triangle].e1);
      const Vec2f scatter{Random(photon, u, bounce, 0), Random(photon, u, bounce, 1)};
      ray = RayFrom(point, frame.ToWorld(CosineHemisphere(scatter)), kInfinity,
                    photon.key + static_cast<uint32_t>(bounce) + 1);
    }
  }

  // Adds what waits, and this thread's totals, to the map's.
  void Flush() {
    for (Waiting& waiting : waiting_) Add(waiting);
    for (size_t c = 0; c < 3; ++c) {
      AddTo(map_.totals.emitted[c], totals_.emitted[c]);
      AddTo(map_.totals.absorbed[c], totals_.absorbed[c]);
      AddTo(map_.totals.escaped[c], totals_.escaped[c]);
    }
    AddTo(map_.totals.rays, totals_.rays);
    AddTo(map_.totals.deposits, totals_.deposits);
    AddTo(map_.totals.cut_paths, totals_.cut_paths);
  }

 private:
  // The first scattering follows the emission's Sobol points, later ones hashed numbers.
  float Random(const Photon& photon, const SobolPoint& u, int bounce, int what) const {
    if (bounce == 0) return u.Get(4 + what);
    return UnitFloat(HashCombine(photon.key, static_cast<uint32_t>(4 * bounce + what)));
  }

  int64_t ToFixed(float flux) const { return std::llrint(static_cast<double>(flux) * scale_); }
  Fixed ToFixed(Rgb flux) const { return {ToFixed(flux.x), ToFixed(flux.y), ToFixed(flux.z)}; }

  static void Accumulate(Fixed& sum, const Fixed& value) {
    for (size_t c = 0; c < 3; ++c) sum[c] += value[c];
  }

  // Flux on its way to a cell, which is seldom in the processor's caches.
  struct Waiting {
    CellFlux* cell = nullptr;
    Fixed flux{};
    int64_t luminance = 0;
    int group = 0;
  };

  void Deposit(const Hit& hit, const SurfacePoint& point, const Fixed& flux, int64_t luminance, int group) {
    const uint32_t cell = cells_.CellAt(hit.triangle, point.position);
    CellFlux& target = map_.flux[2 * static_cast<size_t>(cell) + (hit.back ? 1 : 0)];
    __builtin_prefetch(&target.flux, 1);
    __builtin_prefetch(&target.group[static_cast<size_t>(group)], 1);
    Waiting& oldest = waiting_[static_cast<size_t>(totals_.deposits++) % waiting_.size()];
    Add(oldest);
    oldest = {&target, flux, luminance, group};
  }

  void Add(const Waiting& waiting) {
    if (waiting.cell == nullptr) return;
    CellFlux& cell = *waiting.cell;
    for (size_t c = 0; c < 3; ++c) AddTo(cell.flux[c], waiting.flux[c]);
    AddTo(cell.group[static_cast<size_t>(waiting.group)], waiting.luminance);
    std::atomic_ref<uint32_t>(cell.count).fetch_add(1, std::memory_order_relaxed);
  }

  const World& world_;
  const SurfaceCells& cells_;
  const double scale_;
  PhotonMap& map_;
  PhotonTotals totals_;
  std::array<Waiting, 8> waiting_;
};

float UsefulFlux(const LightSet& lights, const EmissionGuide& guide, const PhotonSource& source) {
  const float square = 4 * lights.world().radius() * lights.world().radius();
  switch (source.kind) {
    case PhotonSource::Kind::kDirectional:
      return Luminance(lights.directionals()[source.light].intensity) * square * guide.UsefulSun(source.light);
    case PhotonSource::Kind::kSky:
      return Luminance(lights.environment().Fluence()) * square * guide.UsefulSky();
    case PhotonSource::Kind::kLocal:
      break;
  }
  return lights.Power(source.light);
}

// A bound of the flux that one of the source's photons carries, from its closed form.
float MaxWeight(const LightSet& lights, const PhotonSource& source) {
  const double n = static_cast<double>(source.count);
  const double square =
      4.0 * static_cast<double>(lights.world().radius()) * static_cast<double>(lights.world().radius());
  const double share = EmissionGuide::kUniformShare;
  double flux = 0;
  if (source.kind == PhotonSource::Kind::kDirectional) {
    flux = static_cast<double>(MaxComponent(lights.directionals()[source.light].intensity)) * square / share;
  } else if (source.kind == PhotonSource::Kind::kSky) {
    // Radiance over the direction density: fluence, over the least useful share (0.02 of 1.02), times the largest ratio
    // of a channel to luminance (14), times 2 for the change within a cell of a gradient.
    flux = static_cast<double>(MaxComponent(lights.environment().Fluence())) * square / share * 52 * 32;
  } else if (!lights.IsEmissive(source.light)) {
    flux = static_cast<double>(MaxComponent(lights.locals()[source.light].intensity)) * 4 * kPi;
  } else {
    const EmissiveTriangle& e = lights.emissive()[static_cast<size_t>(source.light) - lights.locals().size()];
    const Material& material = lights.world().MaterialOf(lights.world().triangles()[e.triangle]);
    const EmissionTable* table = lights.TableOf(e);
    const double area = 2 * static_cast<double>(e.area);
    flux = static_cast<double>(table ? table->most_over_pdf() : MaxComponent(material.emission)) * area * kPi;
  }
  return static_cast<float>(flux / n * 1.001);
}

}  // namespace

PhotonPlan PlanPhotons(const LightSet& lights, const EmissionGuide& guide, int64_t photons, uint32_t seed) {
  PhotonPlan plan;
  plan.seed = seed;
  for (int i = 0; i < lights.local_count(); ++i) plan.sources.push_back({PhotonSource::Kind::kLocal, i});
  for (size_t i = 0; i < lights.directionals().size(); ++i) {
    plan.sources.push_back({PhotonSource::Kind::kDirectional, static_cast<int>(i)});
  }
  if (lights.environment().bright()) plan.sources.push_back({PhotonSource::Kind::kSky, 0});
  double total = 0;
  for (const PhotonSource& source : plan.sources) total += static_cast<double>(UsefulFlux(lights, guide, source));
  double max_weight = 0;
  for (PhotonSource& source : plan.sources) {
    const double share = total > 0 ? static_cast<double>(UsefulFlux(lights, guide, source)) / total : 0;
    source.first = plan.photons;
    source.count = std::max<int64_t>(1, std::llround(share * static_cast<double>(photons)));
    source.max_weight = MaxWeight(lights, source);
    plan.photons += source.count;
    max_weight = std::max(max_weight, static_cast<double>(source.max_weight));
  }
  const double most = static_cast<double>(std::max<int64_t>(plan.photons, 1)) * kMaxPhotonBounces * max_weight;
  plan.fixed_point_scale = most > 0 ? 0x1p62 / most : 1;
  return plan;
}

void EmitPhotons(const World& world, const LightSet& lights, const EmissionGuide& guide, const SurfaceCells& cells,
                 const PhotonPlan& plan, int64_t begin, int64_t end, const Progress& progress, PhotonMap& map) {
  const Emitter emitter(world, lights, guide, plan);
  Tracer tracer(world, cells, plan.fixed_point_scale, map);
  for (size_t s = 0; s < plan.sources.size(); ++s) {
    const PhotonSource& source = plan.sources[s];
    const SobolSet set(HashCombine(HashCombine(plan.seed, 0x50b01u), static_cast<uint32_t>(s)));
    const int64_t first = std::max(begin, source.first), last = std::min(end, source.first + source.count);
    for (int64_t photon = first; photon < last; ++photon) {
      if ((photon & 1023) == 0 && progress.Cancelled()) break;
      const SobolPoint u = set.At(static_cast<uint32_t>(photon - source.first));
      const Photon drawn = emitter.Emit(source, u, photon);
      BAKEWELL_CHECK_OP(MaxComponent(drawn.flux), <=, source.max_weight);
      tracer.Trace(drawn, u, static_cast<int>(photon % kVarianceGroups));
    }
  }
  tracer.Flush();
}

}  // namespace bakewell
