#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <map>

#include "client/local/bake_texels.h"
#include "tests/support/skip_levels.h"

// bench_skip QUALITY REPEATS LEVEL...: what leaving out each kind saves, and what it costs: CPU time of photons,
// density and gather with everything skipped and with all but that kind, in turns, on levels made for it and on files.
namespace bakewell {
namespace {

class NoProgress : public Progress {
 public:
  void Report(std::string_view, int64_t, int64_t) override {}
};

absl::StatusOr<LoadedLevel> MakeLevel(const std::string& name) {
  static const std::map<std::string, std::function<Scene()>> levels = {
      {"dark", [] { return RoomsLevel(256, 0); }},   {"rooms", [] { return RoomsLevel(256, 1); }},
      {"bunker", [] { return BunkerLevel(256); }},   {"plane", [] { return PlaneLevel(256); }},
      {"foliage", [] { return FoliageLevel(128); }}, {"half_dark", [] { return SlitLevel(256, 0); }},
      {"spots", [] { return SpotsLevel(192); }}};
  const auto made = levels.find(name);
  if (made == levels.end()) return LoadLevel(name);
  LoadedLevel level;
  level.scene = made->second();
  return level;
}

struct Run {
  BakedTexels baked;
  double cpu_s = 0;
};

absl::StatusOr<Run> Bake(const std::string& name, const BakeSettings& settings) {
  NoProgress progress;
  PhaseClock clock;
  BAKEWELL_ASSIGN_OR_RETURN(LoadedLevel level, MakeLevel(name));
  BAKEWELL_ASSIGN_OR_RETURN(const PreparedLevel prepared, PrepareLevel(std::move(level), settings, clock, progress));
  Run run;
  const double begin = PhaseClock::CpuSeconds();
  BAKEWELL_ASSIGN_OR_RETURN(run.baked, BakeTexels(prepared, settings, clock, progress));
  run.cpu_s = PhaseClock::CpuSeconds() - begin;
  return run;
}

double RaysOf(const BakedTexels& baked) {
  const GatherCounters& c = baked.counters;
  return static_cast<double>(baked.photon_rays + baked.density_rays + c.gather_rays + c.shadow_rays + c.bounce_rays +
                             c.validity_rays + c.filter_rays);
}

double RelativeRms(const BakedTexels& a, const BakedTexels& b) {
  double square = 0, sum = 0;
  for (size_t i = 0; i < a.lights.size(); ++i) {
    const double of_b = static_cast<double>(Luminance(b.lights[i].irradiance));
    square += std::pow(static_cast<double>(Luminance(a.lights[i].irradiance)) - of_b, 2);
    sum += of_b;
  }
  return sum > 0 ? std::sqrt(square * static_cast<double>(a.lights.size())) / sum : 0;
}

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

absl::Status Compare(const std::string& level, Quality quality, int repeats) {
  BakeSettings all;
  all.quality = quality;
  std::vector<BakeSettings> variants = {all};
  for (size_t i = 0; i < kSkipNames.size(); ++i) {
    variants.push_back(all);
    variants.back().no_skip.Add(static_cast<Skip>(i));
  }
  std::vector<std::vector<double>> cpu_s(variants.size());
  std::vector<Run> runs(variants.size());
  for (int turn = 0; turn < repeats; ++turn) {
    for (size_t v = 0; v < variants.size(); ++v) {
      // Where a kind left nothing out, leaving it in is the same bake.
      if (v > 0 && runs[0].baked.counters.skip.kind[v - 1].skipped == 0) continue;
      BAKEWELL_ASSIGN_OR_RETURN(runs[v], Bake(level, variants[v]));
      cpu_s[v].push_back(runs[v].cpu_s);
    }
  }
  const SkipTally& tally = runs[0].baked.counters.skip;
  std::cout << absl::StrFormat("%s: %d texels, audited %d, failed over %d, largest %.4f\n", level,
                               runs[0].baked.lights.size(), tally.audited, tally.failed_over,
                               1e-6 * static_cast<double>(tally.found_ppm));
  for (size_t v = 1; v < variants.size(); ++v) {
    if (cpu_s[v].empty()) continue;
    const SkipCount& count = tally.kind[v - 1];
    std::cout << absl::StrFormat("| %s | %s | %d of %d | %.3f / %.3f | %.2f | %.2f | %.3f %% |\n", level,
                                 kSkipNames[v - 1], count.skipped, count.of, 1e-6 * RaysOf(runs[0].baked),
                                 1e-6 * RaysOf(runs[v].baked), RaysOf(runs[v].baked) / RaysOf(runs[0].baked),
                                 Median(cpu_s[v]) / Median(cpu_s[0]), 100 * RelativeRms(runs[0].baked, runs[v].baked));
  }
  return absl::OkStatus();
}

}  // namespace
}  // namespace bakewell

int main(int argc, char** argv) {
  const std::map<std::string, bakewell::Quality> qualities = {{"preview", bakewell::Quality::kPreview},
                                                              {"medium", bakewell::Quality::kMedium},
                                                              {"high", bakewell::Quality::kHigh}};
  if (argc < 4 || !qualities.contains(argv[1]) || std::atoi(argv[2]) < 1) {
    std::cerr << "usage: bench_skip preview|medium|high REPEATS LEVEL...\n";
    return 2;
  }
  for (int i = 3; i < argc; ++i) {
    const absl::Status status = bakewell::Compare(argv[i], qualities.at(argv[1]), std::atoi(argv[2]));
    if (!status.ok()) {
      std::cerr << status << "\n";
      return 1;
    }
  }
  return 0;
}
