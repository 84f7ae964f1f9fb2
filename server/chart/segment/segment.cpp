#include "server/chart/segment/segment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <queue>
#include <tuple>

#include "server/chart/keyed_random.h"
#include "server/chart/segment/region_graph.h"

namespace bakewell::chart {
namespace {

// By how much costs are varied, and what is added to them first, so that those of planes, about 0, differ too.
constexpr double kVariation = 0.005, kLeastCost = 1e-4;
// Patches: most faces, largest turn over an edge (10 degrees) and mean deviation (a cap of 8 degrees).
constexpr uint32_t kPatchFaces = 32;
constexpr double kPatchCrease = 0.015, kPatchDeviation = 0.005;
// Mean deviation 1 - |sum of area normals| / area at which the normal term counts 1: that of a spherical cap of 64
// degrees.
constexpr double kUnitDeviation = 0.28;
constexpr double kCreaseScale = 0.7, kRaggedScale = 0.12;
constexpr float kAlwaysSeam = 1000;
// Curved charts are solved for; sparse factorisation grows faster than n log n, so their size is bounded.
constexpr uint32_t kMaxCurvedFaces = 16384;
constexpr double kFlatDeviation = 1e-6;

// The weighted cost of merging the two regions of a link; terms are ratios.
class Cost {
 public:
  Cost(const RegionGraph& graph, const ChartOptions& options, double scale)
      : graph_(graph),
        options_(options),
        max_area_(options.maxChartArea > 0 ? options.maxChartArea * scale * scale : INFINITY),
        max_outline_(options.maxBoundaryLength > 0 ? options.maxBoundaryLength * scale : INFINITY) {}

  // Whether the two regions of a link may be one patch.
  bool JoinsPatch(const Link& link) const {
    const Region &a = graph_.RegionAt(link.a), &b = graph_.RegionAt(link.b);
    return a.faces + b.faces <= kPatchFaces && link.sharpest <= kPatchCrease && link.texture_seam == 0 &&
           Deviation(a, b) <= kPatchDeviation && Of(link) <= options_.maxCost;
  }

  uint32_t JoinedEdges(const Link& link) const {
    return graph_.RegionAt(link.a).edges + graph_.RegionAt(link.b).edges - 2 * link.edges;
  }

  double Of(const Link& link) const {
    const Region &a = graph_.RegionAt(link.a), &b = graph_.RegionAt(link.b);
    const double area = a.area + b.area;
    const double outline = std::max(0.0, a.outline + b.outline - 2 * link.length);
    if (area > max_area_ || outline > max_outline_) return INFINITY;
    if (options_.normalSeamWeight >= kAlwaysSeam && link.sharp > 0) return INFINITY;
    if (options_.textureSeamWeight >= kAlwaysSeam && link.texture_seam > 0) return INFINITY;
    const double deviation = Deviation(a, b) / kUnitDeviation;
    if (a.faces + b.faces > kMaxCurvedFaces && deviation > kFlatDeviation) return INFINITY;
    const double roundness = outline > 0 ? 1 - std::min(1.0, 4 * kPi * area / (outline * outline)) : 1;
    const double shared = link.length / std::min(a.outline, b.outline);
    const double ragged = std::max(0.0, 0.25 - shared);
    return options_.normalDeviationWeight * deviation + options_.roundnessWeight * roundness +
           options_.straightnessWeight * kRaggedScale * ragged * std::min(1.0, deviation) +
           options_.normalSeamWeight * kCreaseScale * link.crease / link.length +
           options_.textureSeamWeight * link.texture_seam / link.length;
  }

 private:
  static double Deviation(const Region& a, const Region& b) {
    return std::max(0.0, 1 - Length(a.area_normal + b.area_normal) / (a.area + b.area));
  }

  const RegionGraph& graph_;
  const ChartOptions& options_;
  double max_area_, max_outline_;
};

// Joins faces to patches of up to kPatchFaces where the surface is smooth, by counts alone: what has the fewest border
// edges when joined first, then in the order of the faces. Lengths and angles would choose no better here, and on a
// regular mesh it would be the rounding of the input that chooses.
void MergePatches(RegionGraph& graph, const Cost& cost) {
  // k triangles have at most k + 2 border edges. A list may be added to while it is drained.
  std::array<std::vector<uint32_t>, kPatchFaces + 3> of_edges;
  const auto push = [&](uint32_t link, uint32_t least) {
    if (cost.JoinsPatch(graph.LinkAt(link)))
      of_edges[std::max(least, cost.JoinedEdges(graph.LinkAt(link)))].push_back(link);
  };
  for (uint32_t l = 0; l < graph.LinkCount(); ++l) push(l, 0);
  for (uint32_t edges = 0; edges < of_edges.size(); ++edges)
    for (size_t i = 0; i < of_edges[edges].size(); ++i) {
      const uint32_t link = of_edges[edges][i];
      if (!graph.LinkAt(link).alive || !cost.JoinsPatch(graph.LinkAt(link))) continue;
      if (cost.JoinedEdges(graph.LinkAt(link)) > edges) {
        push(link, edges);
        continue;
      }
      for (const uint32_t changed : graph.Merge(link)) push(changed, edges);
    }
}

// What to merge next: the link of least rank.
struct Entry {
  double rank;
  uint64_t name;  // of the link
  uint32_t link;
  bool operator>(const Entry& o) const { return std::tie(rank, name) > std::tie(o.rank, o.name); }
};

// Merges regions, cheapest first. Costs are varied by a keyed share, so that those of a regular mesh are not equal up
// to rounding; then only merges that touch one another need their order, and no rounding changes it but by rare chance.
class Merger {
 public:
  Merger(RegionGraph& graph, const Cost& cost, double max_cost)
      : graph_(graph), cost_(cost), max_cost_(max_cost), rank_(graph.LinkCount(), INFINITY) {}

  void Run() {
    for (uint32_t l = 0; l < graph_.LinkCount(); ++l)
      if (graph_.LinkAt(l).alive) Push(l);
    while (!queue_.empty()) {
      const Entry e = queue_.top();
      queue_.pop();
      if (!graph_.LinkAt(e.link).alive || e.rank != rank_[e.link]) continue;
      // Costs move while regions grow: what became dearer waits for its turn.
      if (RankOf(e.link) > e.rank) {
        Push(e.link);
        continue;
      }
      for (const uint32_t changed : graph_.Merge(e.link)) Push(changed);
    }
  }

 private:
  uint64_t NameOf(uint32_t link) const {
    const auto [a, b] =
        std::minmax(graph_.RegionAt(graph_.LinkAt(link).a).first, graph_.RegionAt(graph_.LinkAt(link).b).first);
    return uint64_t{a} << 32 | b;
  }
  // Infinite where the merge is not allowed.
  double RankOf(uint32_t link) const {
    const double cost = cost_.Of(graph_.LinkAt(link));
    const uint64_t name = NameOf(link);
    const double random = KeyedRandom(static_cast<uint32_t>(name >> 32), static_cast<uint32_t>(name));
    return cost <= max_cost_ ? (cost + kLeastCost) * (1 + kVariation * random) : INFINITY;
  }
  void Push(uint32_t link) {
    rank_[link] = RankOf(link);
    if (rank_[link] < INFINITY) queue_.push({rank_[link], NameOf(link), link});
  }

  RegionGraph& graph_;
  const Cost& cost_;
  double max_cost_;
  std::vector<double> rank_;  // per link, of its valid entry
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue_;
};

std::vector<uint32_t> NumberRegions(RegionGraph& graph, uint32_t face_count) {
  std::vector<uint32_t> label(face_count), number(face_count, kNone);
  uint32_t next = 0;
  for (uint32_t f = 0; f < face_count; ++f) {
    const uint32_t root = graph.Find(f);
    if (number[root] == kNone) number[root] = next++;
    label[f] = number[root];
  }
  return label;
}

}  // namespace

std::vector<uint32_t> Segment(const Surface& surface, const ChartOptions& options, std::span<const uint8_t> seam) {
  RegionGraph graph(surface, seam);
  const Cost cost(graph, options, surface.scale);
  MergePatches(graph, cost);
  Merger(graph, cost, options.maxCost).Run();
  return NumberRegions(graph, surface.FaceCount());
}

}  // namespace bakewell::chart
