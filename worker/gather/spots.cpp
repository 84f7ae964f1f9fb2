#include "worker/gather/spots.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <tuple>

#include "worker/sample/hash.h"

namespace bakewell {
namespace {

using PyramidSpot = BrightnessPyramid::Spot;

constexpr float kLeastBrighter = 1.5f;  // reflected by a spot, over what the tile expects
constexpr float kAlbedo = 0.5f;         // of what no ray has met yet
constexpr float kMostAimed = 0.4f;      // share of the rays: what no photon saw, as the sky, has to be found too
constexpr float kShareStep = 0.05f;
constexpr double kWorth = 0.2;  // variance of rays that meet the spots by chance, over the square of the tile's light
constexpr float kLarge = 0.5f;  // half a side over the distance: it is divided
constexpr float kUneven = 2;    // typical irradiance over the mean: likewise
constexpr float kNeedle = 1e-30f;  // square of half a side [m^2]
constexpr uint32_t kProbes = 4;    // a spot
constexpr float kGrazing = 0.1f;   // half sides: a spot in the texel's plane is not quite flat

double Square(float x) { return static_cast<double>(x) * static_cast<double>(x); }

uint32_t KeyOf(const BrightnessPyramid::Square& square, uint32_t key) {
  for (const int part : {static_cast<int>(square.patch), square.level, square.x, square.y, square.back ? 1 : 0})
    key = HashCombine(key, static_cast<uint32_t>(part));
  return key;
}

// What a few rays from a tile's texels say about a spot.
struct Probed {
  int tried = 0, seen = 0;
  float albedo = 0;  // sum, luminance
};
Probed Probe(const GatherScene& scene, const BrightnessPyramid& pyramid, const PyramidSpot& spot, const TexelMap& map,
             std::span<const Texel> texels, uint32_t key, GatherCounters& counters) {
  Probed probed;
  for (uint32_t i = 0; i < kProbes; ++i) {
    const uint32_t probe = HashCombine(KeyOf(spot.square, key), i);
    const auto random = [&](uint32_t what) { return UnitFloat(HashCombine(probe, what)); };
    const float at = (static_cast<float>(i) + random(0)) / kProbes * static_cast<float>(texels.size());
    const Texel& texel = texels[std::min(static_cast<size_t>(at), texels.size() - 1)];
    SurfacePoint point = scene.world.PointAt(map.fragments[texel.fragment_begin].triangle, 0, 0, false);
    point.position = texel.position;
    point.normal = texel.normal;
    const Vec3f to = spot.place.center + spot.place.u * (2 * random(1) - 1) + spot.place.v * (2 * random(2) - 1);
    const Vec3f dir = NormalizeOrZero(to - point.position);
    if (Dot(dir, point.normal) <= 0 || Dot(dir, spot.place.normal) >= 0) continue;
    ++probed.tried;
    ++counters.shadow_rays;
    const Hit hit = scene.world.Intersect(RayFrom(point, dir, std::numeric_limits<float>::infinity(), probe));
    if (!hit || hit.back != spot.square.back) continue;
    if (!pyramid.Holds(spot.square, hit.triangle, scene.world.PointAt(hit).position)) continue;
    ++probed.seen;
    probed.albedo += Luminance(scene.world.AlbedoAt(hit));
  }
  return probed;
}

}  // namespace

float TileSpots::Ball::SquareDistance(Vec3f position) const {
  const Vec3f d = position - center;
  return std::max(Dot(d, d), radius * radius);
}

// Of sides with a typical irradiance above `least`: the one that brings most variance is divided or taken, from whole
// patches on.
std::vector<PyramidSpot> TileSpots::Brightest(const BrightnessPyramid& pyramid, const Ball& tile, float least) {
  struct Candidate {
    float variance;  // in proportion
    PyramidSpot spot;
    bool operator<(const Candidate& other) const {
      return std::tie(variance, other.spot.square) < std::tie(other.variance, spot.square);
    }
  };
  std::vector<Candidate> heap;
  const auto consider = [&](const PyramidSpot& spot) {
    const BrightnessPyramid::Place& place = spot.place;
    if (!(std::min(Dot(place.u, place.u), Dot(place.v, place.v)) > kNeedle)) return false;
    if (Dot(tile.center - place.center, place.normal) + tile.radius + std::sqrt(place.area) <= 0) return false;
    heap.push_back({spot.light.square / (tile.SquareDistance(place.center) + place.area), spot});
    return true;
  };
  for (const PyramidSpot& patch : pyramid.patches()) {
    if (!(patch.light.Typical() > least)) break;
    consider(patch);
  }
  std::make_heap(heap.begin(), heap.end());
  std::vector<PyramidSpot> found, parts;
  while (!heap.empty() && found.size() < kMost) {
    std::pop_heap(heap.begin(), heap.end());
    const PyramidSpot spot = heap.back().spot;
    heap.pop_back();
    const float area = spot.place.area;
    const bool large = area > 4 * kLarge * kLarge * tile.SquareDistance(spot.place.center);
    const bool uneven = spot.light.Typical() > kUneven * spot.light.flux / area;
    if (spot.square.level == 0 || !(large || uneven)) {
      found.push_back(spot);
      continue;
    }
    parts.clear();
    pyramid.Split(spot.square, parts);
    for (const PyramidSpot& part : parts) {
      if (part.light.Typical() > least && consider(part)) std::push_heap(heap.begin(), heap.end());
    }
  }
  // In an order that does not turn on the last digit of anything.
  std::sort(found.begin(), found.end(), [](const PyramidSpot& a, const PyramidSpot& b) { return a.square < b.square; });
  return found;
}

TileSpots::TileSpots(const GatherScene& scene, const BrightnessPyramid& pyramid, const TexelMap& map,
                     std::span<const Texel> texels, float expected, uint32_t key, GatherCounters& counters)
    : expected_(expected) {
  Ball tile;
  for (const Texel& texel : texels) tile.center += texel.position / static_cast<float>(texels.size());
  for (const Texel& texel : texels) tile.radius = std::max(tile.radius, Length(texel.position - tile.center));
  double variance = 0;
  for (const PyramidSpot& found : Brightest(pyramid, tile, kLeastBrighter * expected / kAlbedo)) {
    const Probed probed = Probe(scene, pyramid, found, map, texels, key, counters);
    if (probed.seen == 0) continue;
    const float seen = static_cast<float>(probed.seen), albedo = probed.albedo / seen;
    const float reflected = found.light.flux / found.place.area * albedo;
    const float visible = seen / static_cast<float>(probed.tried);
    const float distance2 = tile.SquareDistance(found.place.center) + found.place.area;
    variance += Square(reflected) * static_cast<double>(visible * found.place.area / distance2 * kInvPiF);
    Add({found.place, reflected * visible * kInvPiF});
  }
  if (variance < kWorth * Square(expected)) spots_.clear();
}

void TileSpots::Add(const Spot& spot) {
  const Vec3f u = spot.place.u, v = spot.place.v;
  size_t column = 0;
  for (const Vec3f vector : {spot.place.center, spot.place.normal, u / Dot(u, u), v / Dot(v, v)}) {
    for (const float coordinate : {vector.x, vector.y, vector.z}) column_[column++][spots_.size()] = coordinate;
  }
  spots_.push_back(spot);
}

TileSpots::Choice TileSpots::ForTexel(const Texel& texel) const {
  std::array<float, kMost> light{};
  float sum = 0;
  for (size_t i = 0; i < spots_.size(); ++i) {
    const BrightnessPyramid::Place& place = spots_[i].place;
    const Vec3f d = place.center - texel.position;
    const float distance2 = Dot(d, d) + std::numeric_limits<float>::min(), distance = std::sqrt(distance2);
    const float half = 0.5f * std::sqrt(place.area);
    const float cosine = std::min(1.0f, (Dot(d, texel.normal) + half) / distance);
    const float spot_cosine = std::min(1.0f, (kGrazing * half - Dot(d, place.normal)) / distance);
    if (cosine <= 0 || spot_cosine <= 0) continue;
    light[i] = spots_[i].radiance * cosine * spot_cosine * (place.area / (distance2 + place.area));
    sum += light[i];
  }
  Choice choice;
  // Where the rest is as even as that, this leaves the least variance. In steps, so that the same rays are aimed where
  // a last digit differs.
  choice.share = sum > 0 ? std::min(kMostAimed, std::round(sum / (sum + expected_) / kShareStep) * kShareStep) : 0;
  if (!(choice.share > 0)) return {};
  choice.which = Distribution1D(std::span<const float>(light).first(spots_.size()));
  choice.density.assign(kMost, 0);
  for (size_t i = 0; i < spots_.size(); ++i)
    choice.density[i] = choice.which.Probability(static_cast<int>(i)) / spots_[i].place.area;
  return choice;
}

Vec3f TileSpots::Draw(const Choice& choice, Vec2f u) const {
  const Distribution1D::Sample drawn = choice.which.Draw(u.x);
  const BrightnessPyramid::Place& place = spots_[static_cast<size_t>(drawn.index)].place;
  return place.center + place.u * (2 * drawn.remainder - 1) + place.v * (2 * u.y - 1);
}

float TileSpots::Density(const Choice& choice, Vec3f from, Vec3f dir) const {
  constexpr size_t kLanes = 8;
  using Lanes = float __attribute__((vector_size(kLanes * sizeof(float))));
  Lanes sum{};
  for (size_t i = 0; i < spots_.size(); i += kLanes) {
    const auto load = [i](const auto& column) {
      Lanes lanes;
      std::memcpy(&lanes, &column[i], sizeof(lanes));
      return lanes;
    };
    const Lanes x = load(column_[0]) - from.x, y = load(column_[1]) - from.y, z = load(column_[2]) - from.z;
    const Lanes nx = load(column_[3]), ny = load(column_[4]), nz = load(column_[5]);
    // Where the ray meets the spot's plane, from its centre.
    const Lanes along = nx * dir.x + ny * dir.y + nz * dir.z, t = (nx * x + ny * y + nz * z) / along;
    const Lanes px = t * dir.x - x, py = t * dir.y - y, pz = t * dir.z - z;
    const Lanes a = px * load(column_[6]) + py * load(column_[7]) + pz * load(column_[8]);
    const Lanes b = px * load(column_[9]) + py * load(column_[10]) + pz * load(column_[11]);
    const Lanes density = load(choice.density) * t * t / (along > 0 ? along : -along);
    sum += (t > 0) & (a * a <= 1) & (b * b <= 1) ? density : Lanes{};
  }
  float total = 0;
  for (size_t lane = 0; lane < kLanes; ++lane) total += sum[lane];
  return total;
}

}  // namespace bakewell
