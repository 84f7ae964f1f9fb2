#include "worker/light/tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <queue>
#include <tuple>

namespace bakewell {
namespace {

constexpr float kSlackRad = 1e-3f;         // rounding of cones that are joined
constexpr float kSlack = 1e-5f;            // rounding of the cosines that Importance compares
constexpr float kClearlyFarther = 1.001f;  // more than rounding makes of equal distances
constexpr float kLeastLobe = 0.02f;        // of a light's brightest direction, where it emits at all
constexpr float kLeastPenumbra = 1e-3f;    // of a spot light, between cosines
constexpr float kSplitSteps = 1000;        // places told apart along the line that lights are split along

LightShape ShapeOfLight(const LightSet& lights, int light) {
  LightShape shape;
  if (!lights.IsEmissive(light)) {
    const PunctualLight& punctual = lights.locals()[static_cast<size_t>(light)];
    shape.center = punctual.position;
    shape.cone_rad = kPiF;
    shape.intensity = Luminance(punctual.intensity);
    if (punctual.type != LightType::kSpot) return shape;
    shape.axis = punctual.direction;
    shape.cone_rad = std::acos(std::clamp(punctual.cos_outer, -1.0f, 1.0f));
    shape.scale = 1 / std::max(punctual.cos_inner - punctual.cos_outer, kLeastPenumbra);
    shape.offset = -punctual.cos_outer * shape.scale;
    shape.least = kLeastLobe;
    shape.squared = true;
    return shape;
  }
  const EmissiveTriangle& emissive = lights.emissive()[static_cast<size_t>(light) - lights.locals().size()];
  const Triangle& t = lights.world().triangles()[emissive.triangle];
  shape.center = t.p0 + (t.e1 + t.e2) * (1.0f / 3);
  shape.axis = t.normal;
  shape.cone_rad = kPiF / 2;
  shape.two_sided = emissive.two_sided;
  shape.intensity = Luminance(emissive.mean_radiance) * emissive.area;
  shape.softness = 0.5f * emissive.area;
  shape.scale = 1;
  shape.offset = 0;
  shape.least = kLeastLobe;
  for (const Vec3f p : {t.p0, t.p0 + t.e1, t.p0 + t.e2}) {
    shape.radius = std::max(shape.radius, Length(p - shape.center));
  }
  return shape;
}

// Of equally far ones, but for rounding, the first.
Vec3f FarthestFrom(Vec3f from, const std::vector<std::pair<Vec3f, int>>& points) {
  float farthest = 0;
  Vec3f result = from;
  for (const auto& [point, light] : points) {
    const float distance = Length(point - from);
    if (distance > farthest * kClearlyFarther) {
      farthest = distance;
      result = point;
    }
  }
  return result;
}

float SineOf(float cosine) { return std::sqrt(std::max(0.0f, 1 - cosine * cosine)); }

float AngleBetween(Vec3f a, Vec3f b) { return std::acos(std::clamp(Dot(a, b), -1.0f, 1.0f)); }

// The smallest cone around two cones (axis, half angle).
std::pair<Vec3f, float> Join(Vec3f a, float a_rad, Vec3f b, float b_rad) {
  if (a_rad < b_rad) return Join(b, b_rad, a, a_rad);
  const float between = AngleBetween(a, b);
  if (between + b_rad <= a_rad) return {a, a_rad};
  const float half = 0.5f * (a_rad + between + b_rad);
  if (half >= kPiF) return {a, kPiF};
  const Vec3f across = NormalizeOrZero(b - a * Dot(a, b));
  if (Dot(across, across) < 0.5f) return {a, kPiF};
  const float turn = half - a_rad;
  return {NormalizeOrZero(a * std::cos(turn) + across * std::sin(turn)), half + kSlackRad};
}

}  // namespace

LightTree::LightTree(const LightSet& lights) : set_(lights) {
  const int count = lights.local_count();
  if (count == 0) return;
  lights_.resize(static_cast<size_t>(count));
  std::iota(lights_.begin(), lights_.end(), 0);
  nodes_.reserve(2 * static_cast<size_t>(count));
  Build(0, count);
  place_of_light_.resize(lights_.size());
  std::vector<LightShape> shapes;
  for (size_t i = 0; i < lights_.size(); ++i) {
    place_of_light_[static_cast<size_t>(lights_[i])] = static_cast<int>(i);
    shapes.push_back(ShapeOfLight(lights, lights_[i]));
  }
  pack_ = LightPack(shapes);
}

int LightTree::Build(int begin, int end) {
  const int at = static_cast<int>(nodes_.size());
  nodes_.push_back({});
  nodes_.back().begin = begin;
  nodes_.back().end = end;
  if (end - begin > 1) {
    // Halves along the line between two lights far from each other: no axis of the world's, so that a turned level has
    // the same tree.
    std::vector<std::pair<Vec3f, int>> centers;
    for (int i = begin; i < end; ++i) {
      const LightShape shape = ShapeOfLight(set_, lights_[static_cast<size_t>(i)]);
      centers.push_back({shape.center, lights_[static_cast<size_t>(i)]});
    }
    const Vec3f first = FarthestFrom(centers.front().first, centers);
    const Vec3f line = FarthestFrom(first, centers) - first;
    const float length2 = std::max(Dot(line, line), 1e-30f);
    std::vector<std::tuple<int, int, Vec3f>> order;  // place along the line, number
    for (const auto& [center, light] : centers) {
      order.push_back(
          {static_cast<int>(std::lround(kSplitSteps * Dot(center - first, line) / length2)), light, center});
    }
    const auto middle = order.begin() + (end - begin) / 2;
    std::nth_element(order.begin(), middle, order.end(), [](const auto& x, const auto& y) {
      return std::tie(std::get<0>(x), std::get<1>(x)) < std::tie(std::get<0>(y), std::get<1>(y));
    });
    // In their halves by number, so that nothing depends on how nth_element works.
    const auto by_number = [](const auto& x, const auto& y) { return std::get<1>(x) < std::get<1>(y); };
    std::sort(order.begin(), middle, by_number);
    std::sort(middle, order.end(), by_number);
    for (int i = begin; i < end; ++i) {
      lights_[static_cast<size_t>(i)] = std::get<1>(order[static_cast<size_t>(i - begin)]);
    }
    const int half = begin + (end - begin) / 2;
    const int left = Build(begin, half), right = Build(half, end);
    nodes_[static_cast<size_t>(at)].left = left;
    nodes_[static_cast<size_t>(at)].right = right;
  }
  Enclose(nodes_[static_cast<size_t>(at)]);
  return at;
}

void LightTree::Enclose(Node& node) const {
  if (node.left < 0) {
    const int light = lights_[static_cast<size_t>(node.begin)];
    const LightShape shape = ShapeOfLight(set_, light);
    node.center = shape.center;
    node.radius = shape.radius;
    node.axis = shape.axis;
    node.cone_rad = shape.two_sided ? kPiF : std::min(kPiF, shape.cone_rad + kSlackRad);
    node.cos_cone = std::cos(node.cone_rad);
    node.sin_cone = std::sin(node.cone_rad);
    node.intensity = shape.intensity;
    return;
  }
  const Node &a = nodes_[static_cast<size_t>(node.left)], &b = nodes_[static_cast<size_t>(node.right)];
  const float distance = Length(b.center - a.center);
  if (a.radius >= distance + b.radius || b.radius >= distance + a.radius) {
    const Node& larger = a.radius >= b.radius ? a : b;
    node.center = larger.center;
    node.radius = larger.radius;
  } else {
    node.radius = 0.5f * (distance + a.radius + b.radius);
    node.center = a.center + (b.center - a.center) * ((node.radius - a.radius) / distance);
  }
  node.radius *= 1.0001f;
  std::tie(node.axis, node.cone_rad) = Join(a.axis, a.cone_rad, b.axis, b.cone_rad);
  node.cos_cone = std::cos(node.cone_rad);
  node.sin_cone = std::sin(node.cone_rad);
  node.intensity = a.intensity + b.intensity;
}

float LightTree::Importance(int node, const Place& place) const {
  const Node& n = nodes_[static_cast<size_t>(node)];
  if (n.left < 0) {
    return set_.Importance(lights_[static_cast<size_t>(n.begin)], place.position, place.normal, place.radius);
  }
  const Vec3f to_light = n.center - place.position;
  const float reach = n.radius + place.radius, distance = Length(to_light);
  const float distance2 = std::max(distance * distance, 0.25f * reach * reach);
  if (distance <= reach || !(distance > 0)) return n.intensity / std::max(distance2, 1e-30f);
  const Vec3f dir = to_light / distance;
  // Directions to the lights lie within an angle of this sine of `dir`.
  const float sin_spread = reach / distance, cos_spread = std::sqrt(1 - sin_spread * sin_spread);
  float cosine = 1;
  if (Dot(place.normal, place.normal) > 0.5f) {
    const float facing = Dot(place.normal, dir);
    if (facing < cos_spread) {
      // Of the angle to the normal, less the spread.
      cosine = facing * cos_spread + SineOf(facing) * sin_spread;
      if (cosine <= -kSlack) return 0;
      cosine = std::max(0.01f, cosine);
    }
  }
  // The cone widened by the spread, unless that is everywhere.
  if (n.sin_cone * cos_spread + n.cos_cone * sin_spread > 0 &&
      -Dot(n.axis, dir) <= n.cos_cone * cos_spread - n.sin_cone * sin_spread - kSlack) {
    return 0;
  }
  return n.intensity * cosine / distance2;
}

float LightTree::Bound(int node, const Place& place) const {
  const Node& n = nodes_[static_cast<size_t>(node)];
  const Vec3f to_light = n.center - place.position;
  const float reach = n.radius + place.radius, distance = Length(to_light);
  const float least = distance * (1 - 1e-5f) - reach;
  if (!(least > 0)) return std::numeric_limits<float>::infinity();
  const float spread = std::asin(std::min(1.0f, reach / distance)) + kSlackRad;
  if (AngleBetween(n.axis, -to_light / distance) - spread >= n.cone_rad) return 0;
  return n.intensity / (least * least);
}

std::vector<int> LightTree::Cull(std::span<const int> cut, const Place& place, float dispensable) const {
  std::vector<std::pair<float, int>> weakest;
  for (const int node : cut) weakest.push_back({Bound(node, place), node});
  std::sort(weakest.begin(), weakest.end());
  double sum = 0;
  std::vector<int> culled, kept;
  for (const auto& [bound, node] : weakest) {
    sum += static_cast<double>(bound);
    if (sum > static_cast<double>(dispensable)) break;
    culled.push_back(node);
  }
  std::sort(culled.begin(), culled.end());
  for (const int node : cut) {
    if (!std::binary_search(culled.begin(), culled.end(), node)) kept.push_back(node);
  }
  return kept;
}

LightShape LightTree::ShapeOf(int node) const {
  const Node& n = nodes_[static_cast<size_t>(node)];
  if (n.left < 0) return ShapeOfLight(set_, lights_[static_cast<size_t>(n.begin)]);
  return {.center = n.center,
          .radius = n.radius,
          .axis = n.axis,
          .cone_rad = n.cone_rad,
          .intensity = n.intensity,
          .softness = 0.25f * n.radius * n.radius};
}

LightTree::Pick LightTree::Draw(int node, const Place& place, float u) const {
  Pick pick;
  double probability = 1, rest = static_cast<double>(u);
  const Node* n = &nodes_[static_cast<size_t>(node)];
  while (CountOf(*n) > LightPack::kMost) {
    const double left = static_cast<double>(Importance(n->left, place));
    const double right = static_cast<double>(Importance(n->right, place));
    if (!(left + right > 0)) return pick;
    const double share = left / (left + right);
    if (rest < share) {
      rest /= share;
      probability *= share;
      n = &nodes_[static_cast<size_t>(n->left)];
    } else {
      if (!(share < 1)) return pick;
      rest = std::min((rest - share) / (1 - share), 1 - 0x1p-53);
      probability *= 1 - share;
      n = &nodes_[static_cast<size_t>(n->right)];
    }
  }
  const auto begin = static_cast<size_t>(n->begin);
  if (CountOf(*n) == 1) return {lights_[begin], static_cast<float>(probability)};
  LightPack::Weights weights;
  pack_.Weigh(place, begin, static_cast<size_t>(n->end), weights);
  const DrawnWeight drawn = DrawWeight(weights, CountOf(*n), static_cast<float>(rest));
  if (drawn.index < 0) return pick;
  pick.light = lights_[begin + static_cast<size_t>(drawn.index)];
  pick.probability = static_cast<float>(probability) * drawn.probability;
  return pick;
}

float LightTree::Probability(int node, int light, const Place& place) const {
  const int at = place_of_light_[static_cast<size_t>(light)];
  const Node* n = &nodes_[static_cast<size_t>(node)];
  if (at < n->begin || at >= n->end) return 0;
  double probability = 1;
  while (CountOf(*n) > LightPack::kMost) {
    const double left = static_cast<double>(Importance(n->left, place));
    const double right = static_cast<double>(Importance(n->right, place));
    if (!(left + right > 0)) return 0;
    const double share = left / (left + right);
    const Node& left_node = nodes_[static_cast<size_t>(n->left)];
    probability *= at < left_node.end ? share : 1 - share;
    n = at < left_node.end ? &left_node : &nodes_[static_cast<size_t>(n->right)];
  }
  if (CountOf(*n) == 1) return static_cast<float>(probability);
  LightPack::Weights weights;
  pack_.Weigh(place, static_cast<size_t>(n->begin), static_cast<size_t>(n->end), weights);
  if (!(weights.total > 0)) return 0;
  return static_cast<float>(probability) * weights.of[static_cast<size_t>(at - n->begin)] / weights.total;
}

std::span<const int> LightTree::LightsOf(int node) const {
  const Node& n = nodes_[static_cast<size_t>(node)];
  return std::span(lights_).subspan(static_cast<size_t>(n.begin), static_cast<size_t>(n.end - n.begin));
}

std::vector<int> LightTree::Cut(const Place& place, size_t most) const {
  std::vector<int> cut;
  if (empty()) return cut;
  using Candidate = std::pair<float, int>;
  const auto weaker = [](const Candidate& a, const Candidate& b) {
    return std::tuple(a.first, -a.second) < std::tuple(b.first, -b.second);
  };
  std::priority_queue<Candidate, std::vector<Candidate>, decltype(weaker)> open(weaker);
  const auto add = [&](int node) {
    if (IsLeaf(node)) {
      cut.push_back(node);
    } else {
      open.push({Importance(node, place), node});
    }
  };
  add(kRoot);
  while (!open.empty() && cut.size() + open.size() < most) {
    const Node& n = nodes_[static_cast<size_t>(open.top().second)];
    open.pop();
    add(n.left);
    add(n.right);
  }
  for (; !open.empty(); open.pop()) cut.push_back(open.top().second);
  std::sort(cut.begin(), cut.end(), [this](int a, int b) { return LightsOf(a)[0] < LightsOf(b)[0]; });
  return cut;
}

}  // namespace bakewell
