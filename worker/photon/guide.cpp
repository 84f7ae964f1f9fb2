#include "worker/photon/guide.h"

#include <cmath>
#include <limits>

#include "worker/sample/sobol.h"
#include "worker/sample/warp.h"
#include "worker/texel/sampler.h"

namespace bakewell {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kMaxWalk = 5;
constexpr int kPhotonsPerWalk = 2;
constexpr int kCoarse = 4;            // bins a side of a block
constexpr float kCoarseShare = 0.3f;  // of the sky's marks, by blocks: each of its directions has few

int Bin(float unit, int grid) {
  return std::clamp(static_cast<int>((unit * 0.5f + 0.5f) * static_cast<float>(grid)), 0, grid - 1);
}

// Adds every bin's eight neighbours, so that the edge of a window is not lost between marks.
std::vector<float> Widen(std::span<const float> bins, int grid) {
  std::vector<float> wide(bins.size(), 0.0f);
  for (int y = 0; y < grid; ++y) {
    for (int x = 0; x < grid; ++x) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const int nx = x + dx, ny = y + dy;
          if (nx < 0 || ny < 0 || nx >= grid || ny >= grid) continue;
          wide[static_cast<size_t>(y * grid + x)] +=
              bins[static_cast<size_t>(ny * grid + nx)] * (dx == 0 && dy == 0 ? 1.0f : 0.25f);
        }
      }
    }
  }
  return wide;
}

// Marks shared out among the bins of each block, and of the blocks beside it: what few marks can tell.
std::vector<float> Coarse(std::span<const float> bins, int grid) {
  const int blocks = grid / kCoarse;
  std::vector<float> sums(static_cast<size_t>(blocks * blocks), 0.0f), coarse(bins.size());
  const auto block_of = [&](int x, int y) { return static_cast<size_t>(y / kCoarse * blocks + x / kCoarse); };
  for (int y = 0; y < grid; ++y) {
    for (int x = 0; x < grid; ++x) sums[block_of(x, y)] += bins[static_cast<size_t>(y * grid + x)];
  }
  const std::vector<float> wide = Widen(sums, blocks);
  for (int y = 0; y < grid; ++y) {
    for (int x = 0; x < grid; ++x) coarse[static_cast<size_t>(y * grid + x)] = wide[block_of(x, y)];
  }
  return coarse;
}

// A density that is `share` uniform and otherwise follows sqrt of the marks (between flat over what is lit and in
// proportion to it). Uniform where nothing was marked.
std::vector<float> Mix(const std::vector<float>& marks, float share) {
  double total = 0;
  std::vector<float> density(marks.size());
  for (size_t i = 0; i < marks.size(); ++i) total += static_cast<double>(density[i] = std::sqrt(marks[i]));
  const double uniform = 1.0 / static_cast<double>(marks.size());
  for (float& d : density) {
    d = static_cast<float>(total > 0 ? share * uniform + (1 - share) * static_cast<double>(d) / total : uniform);
  }
  return density;
}

// Over how much of the square the marks are spread (their participation ratio): k of n bins that are marked alike give
// k / n, however many marks there are.
float UsefulShare(const std::vector<float>& marks) {
  double sum = 0, roots = 0;
  for (const float m : marks) sum += static_cast<double>(m), roots += std::sqrt(static_cast<double>(m));
  return std::max(sum > 0 ? static_cast<float>(roots * roots / (sum * static_cast<double>(marks.size()))) : 0, 1e-3f);
}

}  // namespace

Frame SunFrame(const PunctualLight& light) { return FrameFromHint(-light.direction, light.tangent); }

struct EmissionGuide::Marks {
  std::vector<std::vector<float>> sun;  // per directional light, kSunGrid^2
  std::vector<float> sky;               // bins x kSkyGrid^2
};

namespace {

Vec2f OnSquare(const World& world, const Frame& frame, Vec3f p) {
  const Vec3f d = p - world.center();
  return {Dot(d, frame.t) / world.radius(), Dot(d, frame.b) / world.radius()};
}

// The axes that the sky's photons are drawn in follow the geometry as far as the sky's symmetry allows, so that a
// turned level meets the same photons.
Frame SkyAxes(const World& world, EnvironmentType type) {
  const Frame fixed = FrameFromHint({0, 1, 0}, {1, 0, 0});
  if (type == EnvironmentType::kLatLong || world.triangles().empty()) return fixed;
  const Triangle& first = world.triangles().front();
  if (type == EnvironmentType::kConstant) return FrameFromHint(first.normal, first.e1);
  for (const Triangle& t : world.triangles()) {
    for (const Vec3f edge : {t.e1, t.e2}) {
      const Vec3f level{edge.x, 0, edge.z};
      if (Length(level) > 0.1f * Length(edge)) return FrameFromHint({0, 1, 0}, level);
    }
  }
  return fixed;
}

}  // namespace

Frame EmissionGuide::SkySquare(Vec3f dir) const {
  const Frame local = FrameFromNormal(dir);
  return {SkyToWorld(local.t), SkyToWorld(local.b), SkyToWorld(local.n)};
}

int EmissionGuide::SkyBin(int x, int y) const {
  return (y * kSkyRows / sky_height_) * kSkyColumns + x * kSkyColumns / sky_width_;
}

namespace {

uint32_t WalkKey(int walk, uint32_t seed) {
  return HashCombine(HashCombine(seed, 0x6a1d3u), static_cast<uint32_t>(walk));
}

}  // namespace

EmissionGuide::Start EmissionGuide::StartOf(int walk, size_t texels, uint32_t seed) {
  const uint32_t key = WalkKey(walk, seed);
  const auto random = [&](uint32_t i) { return UnitFloat(HashCombine(key, i)); };
  return {std::min(texels - 1, static_cast<size_t>(random(0) * static_cast<float>(texels))), {random(1), random(2)}};
}

int EmissionGuide::WalksFor(const LightSet& lights, int64_t photons) {
  // Without sun and sky they have little to find out.
  const bool distant = !lights.directionals().empty() || lights.environment().bright();
  return static_cast<int>(distant ? std::min<int64_t>(photons / kPhotonsPerWalk, 100'000)
                                  : std::min<int64_t>(photons / 16, 20'000));
}

std::vector<TexelPoint> EmissionGuide::StartsIn(const World& world, const AtlasLayout& layout, const TexelMap& map,
                                                int walks, uint32_t seed) {
  std::vector<TexelPoint> starts;
  for (int walk = 0; walk < walks && !map.texels.empty(); ++walk) {
    const Start start = StartOf(walk, map.texels.size(), seed);
    starts.push_back(TexelSampler(world, layout, map, map.texels[start.texel]).At(start.u));
  }
  return starts;
}

EmissionGuide EmissionGuide::Learn(const World& world, const LightSet& lights, const AtlasLayout& layout,
                                   const TexelMap& map, int walks, uint32_t seed) {
  return Learn(world, lights, StartsIn(world, layout, map, walks, seed), seed);
}

EmissionGuide EmissionGuide::Learn(const World& world, const LightSet& lights, std::span<const TexelPoint> starts,
                                   uint32_t seed) {
  EmissionGuide guide;
  guide.sky_width_ = lights.environment().width();
  guide.sky_height_ = lights.environment().height();
  guide.sky_axes_ = SkyAxes(world, lights.environment().type());
  guide.seen_.assign(world.triangles().size(), 0);
  Marks marks;
  marks.sun.assign(lights.directionals().size(), std::vector<float>(kSunGrid * kSunGrid, 0.0f));
  marks.sky.assign(static_cast<size_t>(kSkyColumns) * kSkyRows * kSkyGrid * kSkyGrid, 0.0f);
  const auto mark_sun = [&](const SurfacePoint& point, uint32_t key) {
    for (size_t s = 0; s < lights.directionals().size(); ++s) {
      const PunctualLight& sun = lights.directionals()[s];
      const float cosine = -Dot(sun.direction, point.normal);
      if (cosine <= 0 || world.Occluded(RayFrom(point, -sun.direction, kInfinity, key))) continue;
      const Vec2f p = OnSquare(world, SunFrame(sun), point.position);
      marks.sun[s][static_cast<size_t>(Bin(p.y, kSunGrid) * kSunGrid + Bin(p.x, kSunGrid))] += cosine;
    }
  };
  const auto mark_sky = [&](Vec3f from, Vec3f dir_ws) {
    if (!lights.environment().bright()) return;
    const Vec3f dir = guide.SkyToLocal(dir_ws);
    const float phi = std::atan2(dir.z, dir.x) / (2 * kPiF), v = std::acos(std::clamp(dir.y, -1.0f, 1.0f)) / kPiF;
    const int x = std::clamp(static_cast<int>((phi < 0 ? phi + 1 : phi) * static_cast<float>(guide.sky_width_)), 0,
                             guide.sky_width_ - 1);
    const int y = std::clamp(static_cast<int>(v * static_cast<float>(guide.sky_height_)), 0, guide.sky_height_ - 1);
    const Vec2f p = OnSquare(world, guide.SkySquare(dir), from);
    marks.sky[static_cast<size_t>((guide.SkyBin(x, y) * kSkyGrid + Bin(p.y, kSkyGrid)) * kSkyGrid +
                                  Bin(p.x, kSkyGrid))] += 1;
  };
  for (size_t walk = 0; walk < starts.size(); ++walk) {
    const uint32_t key = WalkKey(static_cast<int>(walk), seed);
    const auto random = [&](int i) { return UnitFloat(HashCombine(key, static_cast<uint32_t>(i))); };
    SurfacePoint at = starts[walk].surface;
    Frame frame = starts[walk].frame;
    for (int step = 0; step < kMaxWalk; ++step) {
      const Vec3f dir = frame.ToWorld(CosineHemisphere({random(10 * step + 10), random(10 * step + 11)}));
      const Hit hit = world.Intersect(RayFrom(at, dir, kInfinity, key + static_cast<uint32_t>(step)));
      if (!hit) {
        if (step > 0) mark_sky(at.position, dir);
        break;
      }
      ++guide.seen_[hit.triangle];
      at = world.PointAt(hit);
      mark_sun(at, key);
      if (random(10 * step + 12) >= MaxComponent(world.AlbedoAt(hit))) break;
      frame = FrameFromHint(at.normal, world.triangles()[hit.triangle].e1);
    }
  }
  guide.Finish(lights, marks);
  return guide;
}

void EmissionGuide::Finish(const LightSet& lights, const Marks& marks) {
  for (const auto& bins : marks.sun) {
    const std::vector<float> wide = Widen(bins, kSunGrid);
    sun_.emplace_back(kSunGrid, kSunGrid, Mix(wide, kUniformShare));
    sun_useful_.push_back(UsefulShare(wide));
  }
  if (lights.environment().bright()) FinishSky(lights.environment(), marks);
}

void EmissionGuide::FinishSky(const EnvironmentLight& sky, const Marks& marks) {
  constexpr size_t kPerBin = kSkyGrid * kSkyGrid;
  constexpr size_t kBins = static_cast<size_t>(kSkyColumns) * kSkyRows;
  std::vector<float> useful(kBins);
  for (size_t bin = 0; bin < kBins; ++bin) {
    const std::span<const float> here = std::span(marks.sky).subspan(bin * kPerBin, kPerBin);
    const std::vector<float> wide = Widen(here, kSkyGrid), coarse = Mix(Coarse(here, kSkyGrid), kUniformShare);
    std::vector<float> density = Mix(wide, kUniformShare);
    for (size_t i = 0; i < kPerBin; ++i) density[i] += kCoarseShare * (coarse[i] - density[i]);
    sky_position_.emplace_back(kSkyGrid, kSkyGrid, density);
    useful[bin] = UsefulShare(wide);
  }
  std::vector<float> weights;
  double useful_flux = 0, flux = 0;
  for (int y = 0; y < sky_height_; ++y) {
    for (int x = 0; x < sky_width_; ++x) {
      const Rgb radiance = sky.Radiance(sky.CellCenter(x, y));
      const float power = (Luminance(radiance) + 1e-3f * MaxComponent(radiance)) * sky.CellSolidAngle(y);
      const float share = useful[static_cast<size_t>(SkyBin(x, y))];
      weights.push_back(power * (share + 0.02f));
      useful_flux += static_cast<double>(power * share);
      flux += static_cast<double>(power);
    }
  }
  sky_direction_ = SphereTable(sky_width_, sky_height_, weights);
  sky_useful_ = flux > 0 ? static_cast<float>(useful_flux / flux) : 1.0f;
}

EmissionGuide::SquarePoint EmissionGuide::Draw(const Distribution2D& table, Vec2f u) {
  const auto drawn = table.Draw(u);
  return {{2 * drawn.position.x - 1, 2 * drawn.position.y - 1}, drawn.pdf};
}

EmissionGuide::SkyPoint EmissionGuide::DrawSky(Vec2f u_direction, Vec2f u_position) const {
  const SphereTable::Sample sky = sky_direction_.Draw(u_direction);
  return {SkyToWorld(sky.dir), SkySquare(sky.dir), sky.pdf,
          Draw(sky_position_[static_cast<size_t>(SkyBin(sky.x, sky.y))], u_position)};
}

}  // namespace bakewell
