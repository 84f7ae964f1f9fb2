#include "worker/level/page_files.h"

#include <absl/strings/str_cat.h>
#include <tbb/parallel_invoke.h>

#include "core/image/exr.h"
#include "core/image/png.h"
#include "worker/finish/charts.h"

namespace bakewell {

absl::StatusOr<MadeOutputs> PageFiles(const TexelMap& map, std::span<const TexelLight> lights, int page) {
  if (page < 0 || page >= static_cast<int>(map.pages.size())) return absl::InvalidArgumentError("no such page");
  const PageImages images = FinishPage(map, lights, page);
  const Image& seen = images.irradiance;
  absl::StatusOr<std::string> irradiance, preview, sh, variance;
  std::string charts;
  tbb::parallel_invoke([&] { sh = ExrBytes(images.sh); },  // most of the work
                       [&] { irradiance = ExrBytes(seen); }, [&] { variance = ExrBytes(images.variance); },
                       [&] { preview = PngBytes(seen.width, seen.height, TonemapPreview(seen)); },
                       [&] { charts = ChartsJson(page, SummarizeCharts(map, lights, page)); });
  for (const auto* encoded : {&irradiance, &preview, &sh, &variance}) BAKEWELL_RETURN_IF_ERROR(encoded->status());
  const std::string stem = absl::StrCat("lightmap-", page);
  MadeOutputs outputs;
  outputs.push_back({stem + ".irradiance.exr", *std::move(irradiance)});
  outputs.push_back({stem + ".png", *std::move(preview)});
  outputs.push_back({stem + ".sh.exr", *std::move(sh)});
  outputs.push_back({stem + ".variance.exr", *std::move(variance)});
  outputs.push_back({stem + ".charts.json", std::move(charts)});
  return outputs;
}

}  // namespace bakewell
