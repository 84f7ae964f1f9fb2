#include "server/chart/flatten/flatten.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "server/chart/flatten/conformal.h"
#include "server/chart/flatten/overlap.h"
#include "server/chart/flatten/project.h"
#include "server/chart/flatten/rigid.h"
#include "server/chart/flatten/split.h"
#include "server/chart/flatten/stretch.h"

namespace bakewell::chart {
namespace {

// Below this a projection is as good as exact: the stretch's own rounding in a float lightmap is of that size.
constexpr double kExactStretch = 1.00002;
constexpr int kMaxPeels = 12;
constexpr double kMaxPeeledShare = 0.2;

// A chart laid into the plane as well as it goes; conflicts are not looked at. Nothing: no map was found.
std::optional<FlatChart> Lay(const Surface& surface, std::span<const uint32_t> faces) {
  FlatChart chart = LocalChart(surface, faces);
  if (faces.size() == 1) {
    LayTriangle(surface, chart);
    return chart;
  }
  ProjectOnMeanPlane(surface, chart);
  const Stretch projected = MeasureStretch(surface, chart);
  if (projected.flipped && !MapConformally(surface, chart)) return std::nullopt;
  if (projected.l2 > kExactStretch) MakeRigid(surface, chart);
  return chart;
}

// The part of a chart that `faces` name (0 .. n-1), with its coordinates.
FlatChart Keep(const Surface& surface, const FlatChart& chart, const std::vector<uint32_t>& faces) {
  std::vector<uint32_t> named;
  for (const uint32_t i : faces) named.push_back(chart.face[i]);
  FlatChart part = LocalChart(surface, named);
  for (size_t i = 0; i < faces.size(); ++i)
    for (int k = 0; k < 3; ++k) part.uv[part.corner[i][k]] = chart.uv[chart.corner[faces[i]][k]];
  return part;
}

class Flattener {
 public:
  Flattener(const Surface& surface, const ChartOptions& options) : surface_(surface), options_(options) {}

  std::vector<FlatChart> Run(std::span<const uint32_t> faces) && {
    open_.push_back({faces.begin(), faces.end()});
    while (!open_.empty()) {
      const std::vector<uint32_t> part = std::move(open_.back());
      open_.pop_back();
      std::optional<FlatChart> chart = Lay(surface_, part);
      if (!chart || !Accept(*std::move(chart))) Open(SplitInTwo(surface_, part));
    }
    return std::move(done_);
  }

 private:
  void Open(std::vector<std::vector<uint32_t>> parts) {
    for (auto& part : parts) open_.push_back(std::move(part));
  }

  // Peels faces in conflict off until what is left is free of it; what was peeled is charted anew. False: too much
  // would go.
  bool Accept(FlatChart chart) {
    const size_t whole = chart.face.size();
    std::vector<uint32_t> peeled;
    for (int round = 0; round < kMaxPeels; ++round) {
      const Conflicts conflicts = FindConflicts(surface_, chart);
      if (conflicts.wrong_loops) return false;
      if (conflicts.None()) return Finish(std::move(chart), peeled);
      if (!Peel(conflicts.face, chart, peeled) || double(peeled.size()) > kMaxPeeledShare * double(whole)) return false;
    }
    return false;
  }

  // Leaves the largest connected part of the chart without the faces in conflict.
  bool Peel(const std::vector<uint32_t>& conflict, FlatChart& chart, std::vector<uint32_t>& peeled) const {
    std::vector<bool> gone(chart.face.size(), false);
    for (const uint32_t i : conflict) gone[i] = true;
    std::vector<uint32_t> left;
    for (uint32_t i = 0; i < chart.face.size(); ++i)
      if (!gone[i]) left.push_back(chart.face[i]);
    const auto parts = ConnectedParts(surface_, left);
    if (parts.empty()) return false;
    const auto largest =
        std::max_element(parts.begin(), parts.end(), [](const auto& a, const auto& b) { return a.size() < b.size(); });
    // Parts keep the order of the chart's faces.
    std::vector<uint32_t> keep;
    for (uint32_t i = 0; i < chart.face.size(); ++i) {
      if (keep.size() < largest->size() && chart.face[i] == (*largest)[keep.size()])
        keep.push_back(i);
      else
        peeled.push_back(chart.face[i]);
    }
    chart = Keep(surface_, chart, keep);
    return true;
  }

  bool Finish(FlatChart chart, const std::vector<uint32_t>& peeled) {
    if (MeasureStretch(surface_, chart).l2 > options_.maxStretch) return false;
    NormalizeArea(surface_, chart);
    done_.push_back(std::move(chart));
    Open(ConnectedParts(surface_, peeled));
    return true;
  }

  const Surface& surface_;
  const ChartOptions& options_;
  std::vector<std::vector<uint32_t>> open_;
  std::vector<FlatChart> done_;
};

}  // namespace

std::vector<FlatChart> Flatten(const Surface& surface, std::span<const uint32_t> faces, const ChartOptions& options) {
  return Flattener(surface, options).Run(faces);
}

}  // namespace bakewell::chart
