#include "server/chart/segment/segment.h"

#include <algorithm>
#include <cmath>

#include "server/chart/segment/region_graph.h"

namespace bakewell::chart {
namespace {

constexpr int kStepsPerCost = 512;
constexpr int kMaxLevels = 8192;
// Mean deviation 1 - |sum of area normals| / area at which the normal term counts 1: that of a spherical cap of 77
// degrees.
constexpr double kUnitDeviation = 0.39;
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

  double Of(const Link& link) const {
    const Region &a = graph_.RegionAt(link.a), &b = graph_.RegionAt(link.b);
    const double area = a.area + b.area;
    const double outline = std::max(0.0, a.outline + b.outline - 2 * link.length);
    if (area > max_area_ || outline > max_outline_) return INFINITY;
    if (options_.normalSeamWeight >= kAlwaysSeam && link.sharp > 0) return INFINITY;
    if (options_.textureSeamWeight >= kAlwaysSeam && link.texture_seam > 0) return INFINITY;
    const double deviation = std::max(0.0, 1 - Length(a.area_normal + b.area_normal) / area) / kUnitDeviation;
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
  const RegionGraph& graph_;
  const ChartOptions& options_;
  double max_area_, max_outline_;
};

// Links by rounded cost, each level first in, first out. A level may be added to while it is drained.
class LevelQueue {
 public:
  explicit LevelQueue(double max_cost)
      : levels_(static_cast<size_t>(std::clamp(max_cost * kStepsPerCost, 0.0, double{kMaxLevels})) + 1) {}

  static int LevelOf(double cost) {
    return static_cast<int>(std::floor(std::min(cost, double{kMaxLevels}) * kStepsPerCost + 0.5));
  }
  int LevelCount() const { return static_cast<int>(levels_.size()); }
  void Push(uint32_t link, int level) {
    if (level < LevelCount()) levels_[level].push_back(link);
  }
  std::vector<uint32_t>& Level(int level) { return levels_[level]; }

 private:
  std::vector<std::vector<uint32_t>> levels_;
};

void MergeAll(RegionGraph& graph, const Cost& cost, double max_cost) {
  LevelQueue queue(max_cost);
  for (uint32_t l = 0; l < graph.LinkCount(); ++l) queue.Push(l, LevelQueue::LevelOf(cost.Of(graph.LinkAt(l))));
  for (int level = 0; level < queue.LevelCount(); ++level) {
    for (size_t i = 0; i < queue.Level(level).size(); ++i) {
      const uint32_t link = queue.Level(level)[i];
      if (!graph.LinkAt(link).alive) continue;
      // Costs move while regions grow: what became dearer waits for its new level.
      const int now = LevelQueue::LevelOf(cost.Of(graph.LinkAt(link)));
      if (now > level) {
        queue.Push(link, now);
        continue;
      }
      for (const uint32_t changed : graph.Merge(link))
        queue.Push(changed, std::max(level, LevelQueue::LevelOf(cost.Of(graph.LinkAt(changed)))));
    }
    queue.Level(level) = {};
  }
}

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
  MergeAll(graph, Cost(graph, options, surface.scale), options.maxCost);
  return NumberRegions(graph, surface.FaceCount());
}

}  // namespace bakewell::chart
