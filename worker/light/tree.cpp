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
constexpr float kClearlyFarther = 1.001f;  // more than rounding makes of equal distances
constexpr float kSplitSteps = 1000;        // places told apart along the line that lights are split along

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

float ConeOf(const LightShape& shape) { return shape.two_sided ? kPiF : shape.cone_rad; }

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
  std::vector<LightShape> shapes, node_shapes;
  for (size_t i = 0; i < lights_.size(); ++i) {
    place_of_light_[static_cast<size_t>(lights_[i])] = static_cast<int>(i);
    shapes.push_back(lights.ShapeOf(lights_[i]));
  }
  pack_ = LightPack(shapes);
  for (const Node& node : nodes_) node_shapes.push_back(node.shape);
  node_pack_ = LightPack(node_shapes);
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
      const int light = lights_[static_cast<size_t>(i)];
      centers.push_back({set_.ShapeOf(light).center, light});
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
  nodes_[static_cast<size_t>(at)].shape = Enclose(nodes_[static_cast<size_t>(at)]);
  return at;
}

LightShape LightTree::Enclose(const Node& node) const {
  if (node.left < 0) return set_.ShapeOf(lights_[static_cast<size_t>(node.begin)]);
  const LightShape &a = nodes_[static_cast<size_t>(node.left)].shape,
                   &b = nodes_[static_cast<size_t>(node.right)].shape;
  LightShape shape;
  const float distance = Length(b.center - a.center);
  if (a.radius >= distance + b.radius || b.radius >= distance + a.radius) {
    const LightShape& larger = a.radius >= b.radius ? a : b;
    shape.center = larger.center;
    shape.radius = larger.radius;
  } else {
    shape.radius = 0.5f * (distance + a.radius + b.radius);
    shape.center = a.center + (b.center - a.center) * ((shape.radius - a.radius) / distance);
  }
  shape.radius *= 1.0001f;
  shape.softness = 0.25f * shape.radius * shape.radius;
  std::tie(shape.axis, shape.cone_rad) = Join(a.axis, ConeOf(a), b.axis, ConeOf(b));
  shape.intensity = a.intensity + b.intensity;
  return shape;
}

float LightTree::Importance(int node, const LitPlace& place) const {
  LightPack::Weights weights;
  node_pack_.Weigh(place, static_cast<size_t>(node), static_cast<size_t>(node) + 1, weights);
  return weights.total;
}

float LightTree::Bound(int node, const LitPlace& place) const {
  const LightShape& shape = nodes_[static_cast<size_t>(node)].shape;
  const Vec3f to_light = shape.center - place.position;
  const float reach = shape.radius + place.radius, distance = Length(to_light);
  const float least = distance * (1 - 1e-5f) - reach;
  if (!(least > 0)) return std::numeric_limits<float>::infinity();
  const float spread = std::asin(std::min(1.0f, reach / distance)) + 2 * kSlackRad;
  if (AngleBetween(shape.axis, -to_light / distance) - spread >= ConeOf(shape)) return 0;
  return shape.intensity / (least * least);
}

std::vector<int> LightTree::Cull(std::span<const int> cut, const LitPlace& place, float dispensable) const {
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

LightTree::Pick LightTree::Draw(int node, const LitPlace& place, float u) const {
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

float LightTree::Probability(int node, int light, const LitPlace& place) const {
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

std::vector<int> LightTree::Cut(const LitPlace& place, size_t most) const {
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
