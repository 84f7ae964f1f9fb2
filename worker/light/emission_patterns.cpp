#include "worker/light/emission_patterns.h"

#include <absl/container/flat_hash_map.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <optional>

#include "worker/trace/float_mode.h"

namespace bakewell {
namespace {

constexpr size_t kTableBytes = size_t{64} << 20;
constexpr double kMostPoints = 1 << 26;  // at which all patterns are looked at, about: 2 s of CPU time
constexpr double kMostTexels = 65536;    // under a triangle, to know that it glows evenly or not at all

struct Pattern {
  uint32_t triangle = 0;  // the first of those that have it
  Rgb mean;
  bool known = false;  // it glows evenly or not at all, by its texels
  std::optional<EmissionTable> table;
};

template <typename Compute>
void ForEach(std::vector<Pattern>& patterns, Compute compute) {
  tbb::parallel_for(size_t{0}, patterns.size(), [&](size_t i) {
    const FlushDenormals mode;
    compute(patterns[i]);
  });
}

void LookAtTexels(const World& world, Pattern& pattern) {
  const auto [least, most] = world.GlowOver(pattern.triangle, kTriangleCorners, kMostTexels);
  pattern.known = least == most || MaxComponent(most) <= 0;
  pattern.mean = most;
}

void MakeTables(const World& world, std::vector<Pattern>& patterns) {
  std::vector<int> sides;
  for (const Pattern& pattern : patterns) {
    if (!pattern.known) sides.push_back(EmissionTable::SideFor(world, pattern.triangle));
  }
  const int largest = EmissionTable::LargestSide(sides, kTableBytes);
  const double points = kMostPoints / static_cast<double>(std::max<size_t>(sides.size(), 1));
  ForEach(patterns, [&](Pattern& pattern) {
    if (pattern.known) return;
    const int side =
        std::min(EmissionTable::SideFor(world, pattern.triangle), std::max(largest, EmissionTable::kLeastSide));
    EmissionTable table(world, pattern.triangle, side, EmissionTable::PointsFor(world, pattern.triangle, side, points));
    pattern.mean = table.mean();
    if (table.varies() && largest > 0) pattern.table = std::move(table);
  });
}

}  // namespace

EmissionPatterns::EmissionPatterns(const World& world) {
  std::vector<Pattern> patterns;
  std::vector<size_t> pattern_of;  // one per element of emitters_
  absl::flat_hash_map<GlowInputs, size_t> number_of;
  for (uint32_t k = 0; k < world.triangles().size(); ++k) {
    if (!world.Emits(k)) continue;
    const auto [found, is_new] = number_of.try_emplace(world.GlowInputsOf(k), patterns.size());
    if (is_new) patterns.emplace_back().triangle = k;
    pattern_of.push_back(found->second);
    emitters_.push_back({.triangle = k});
  }
  ForEach(patterns, [&](Pattern& pattern) { LookAtTexels(world, pattern); });
  MakeTables(world, patterns);
  std::vector<int> table_of(patterns.size(), -1);
  for (size_t i = 0; i < patterns.size(); ++i) {
    if (!patterns[i].table || MaxComponent(patterns[i].mean) <= 0) continue;
    table_of[i] = static_cast<int>(tables_.size());
    tables_.push_back(*std::move(patterns[i].table));
  }
  for (size_t i = 0; i < emitters_.size(); ++i) {
    emitters_[i].mean = patterns[pattern_of[i]].mean;
    emitters_[i].table = table_of[pattern_of[i]];
  }
  std::erase_if(emitters_, [](const Emitter& emitter) { return MaxComponent(emitter.mean) <= 0; });
}

}  // namespace bakewell
