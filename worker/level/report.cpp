#include "worker/level/report.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/base/fields.h"
#include "worker/gather/accumulate.h"

namespace bakewell {

namespace {

constexpr double kMostBadSamples = 1e-6;  // share of samples that are not good, above which a bake fails

}  // namespace

std::array<int64_t*, 11> BakeTally::Integers() {
  return {&counters_.gather_rays,
          &counters_.shadow_rays,
          &counters_.bounce_rays,
          &counters_.validity_rays,
          &counters_.filter_rays,
          &counters_.bad_samples,
          &texels_,
          &valid_,
          &filtered_,
          &direct_samples_,
          &indirect_samples_};
}

void BakeTally::Add(const BakeTally& page) {
  BakeTally other = page;
  const auto to = Integers(), from = other.Integers();
  for (size_t i = 0; i < to.size(); ++i) *to[i] += *from[i];
  counters_.skip.Add(other.counters_.skip);
  variance_ += other.variance_;
  irradiance_ += other.irradiance_;
  bias_square_ += other.bias_square_;
}

std::string BakeTally::Serialize() const {
  BakeTally copy = *this;
  FieldWriter writer;
  for (const int64_t* value : copy.Integers()) writer.Put(static_cast<uint64_t>(*value));
  for (const double value : {variance_, irradiance_, bias_square_}) writer.Put(std::bit_cast<uint64_t>(value));
  writer.PutString(bakewell::Serialize(counters_.skip));
  return std::move(writer).bytes();
}

absl::StatusOr<BakeTally> BakeTally::Parse(std::string_view bytes) {
  FieldReader reader(bytes);
  BakeTally tally;
  for (int64_t* value : tally.Integers()) *value = static_cast<int64_t>(reader.Get<uint64_t>());
  for (double* value : {&tally.variance_, &tally.irradiance_, &tally.bias_square_})
    *value = std::bit_cast<double>(reader.Get<uint64_t>());
  const std::string skip = reader.GetString();
  BAKEWELL_RETURN_IF_ERROR(reader.Finish("tally"));
  BAKEWELL_ASSIGN_OR_RETURN(tally.counters_.skip, ParseSkipTally(skip));
  return tally;
}

void BakeTally::Count(const GatherCounters& counters) { counters_.Add(counters); }

void BakeTally::Count(std::span<const TexelLight> lights, const FilterCounters& filter) {
  filtered_ += filter.filtered;
  bias_square_ += filter.bias_square;
  counters_.filter_rays += filter.rays;
  texels_ += std::ssize(lights);
  for (const TexelLight& light : lights) {
    direct_samples_ += light.direct_samples;
    indirect_samples_ += light.indirect_samples;
    if (!light.valid) continue;
    variance_ += static_cast<double>(LuminanceVariance(light.variance));
    irradiance_ += static_cast<double>(Luminance(light.irradiance));
    ++valid_;
  }
}

double BakeTally::OverMean(double squares) const {
  const double count = static_cast<double>(valid_);
  return irradiance_ > 0 ? std::sqrt(squares / count) / (irradiance_ / count) : 0;
}

namespace {

void CountSkips(const SkipTally& tally, const SkipSet& no_skip, std::map<std::string, int64_t>& counters) {
  for (size_t i = 0; i < kSkipNames.size(); ++i) {
    const std::string name = absl::StrCat("skip/", kSkipNames[i], "/");
    counters[name + "enabled"] = no_skip.Has(static_cast<Skip>(i)) ? 0 : 1;
    counters[name + "skipped"] = tally.kind[i].skipped;
    counters[name + "of"] = tally.kind[i].of;
    counters[name + "saved"] = tally.kind[i].saved;
  }
  counters["skip/audit/texels"] = tally.audited;
  counters["skip/audit/failed_over"] = tally.failed_over;
  counters["skip/audit/found_ppm"] = tally.found_ppm;
}

}  // namespace

absl::StatusOr<BakeReport> BakeTally::Finish(const level_task::PhotonCounts& photons, int64_t overlapping_texels,
                                             const SkipSet& no_skip) const {
  const double samples = static_cast<double>(counters_.gather_rays + counters_.shadow_rays);
  if (static_cast<double>(counters_.bad_samples) > kMostBadSamples * samples) {
    return absl::InvalidArgumentError(absl::StrCat(
        counters_.bad_samples, " of ", static_cast<int64_t>(samples), " samples were no numbers or above ",
        kBrightestSample,
        " W m^-2; move lamps away from the surfaces that they touch, or scale all lights of this scene down"));
  }
  BakeReport report;
  report.counters = {{"texels/covered", texels_},
                     {"texels/invalid", texels_ - valid_},
                     {"texels/validity_rays", counters_.validity_rays},
                     {"photons/rays", photons.photon_rays},
                     {"photons/cells", photons.cells},
                     {"density/rays", photons.density_rays},
                     {"filter/rays", counters_.filter_rays},
                     {"filter/texels", filtered_},
                     {"filter/bias_ppm", std::llround(1e6 * OverMean(std::max(0.0, bias_square_)))},
                     {"gather/direct_samples", direct_samples_},
                     {"gather/indirect_samples", indirect_samples_},
                     {"gather/rays", counters_.gather_rays},
                     {"gather/shadow_rays", counters_.shadow_rays},
                     {"gather/bounce_rays", counters_.bounce_rays},
                     {"gather/bad_samples", counters_.bad_samples}};
  CountSkips(counters_.skip, no_skip, report.counters);
  report.photons = photons.photons;
  report.rays = photons.photon_rays + photons.density_rays + counters_.gather_rays + counters_.shadow_rays +
                counters_.bounce_rays + counters_.validity_rays + counters_.filter_rays;
  report.estimated_error = EstimatedError();
  if (overlapping_texels > 0) {
    report.warnings.push_back(
        absl::StrCat(overlapping_texels,
                     " texels are covered by more than one chart: their TEXCOORD_1 overlaps or lies closer than ",
                     "a texel; use --uv generate"));
  }
  return report;
}

}  // namespace bakewell
