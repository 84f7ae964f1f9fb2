#include "worker/level/page_files.h"

#include <absl/strings/str_cat.h>

#include "core/image/exr.h"
#include "core/image/png.h"
#include "worker/finish/charts.h"

namespace bakewell {

absl::StatusOr<MadeOutputs> PageFiles(const TexelMap& map, std::span<const TexelLight> lights, int page) {
  if (page < 0 || page >= static_cast<int>(map.pages.size())) return absl::InvalidArgumentError("no such page");
  const PageImages images = FinishPage(map, lights, page);
  const Image& irradiance = images.irradiance;
  const std::string stem = absl::StrCat("lightmap-", page);
  MadeOutputs outputs(5);
  outputs[0].name = stem + ".irradiance.exr";
  BAKEWELL_ASSIGN_OR_RETURN(outputs[0].bytes, ExrBytes(irradiance));
  outputs[1].name = stem + ".png";
  BAKEWELL_ASSIGN_OR_RETURN(outputs[1].bytes,
                            PngBytes(irradiance.width, irradiance.height, TonemapPreview(irradiance)));
  outputs[2].name = stem + ".sh.exr";
  BAKEWELL_ASSIGN_OR_RETURN(outputs[2].bytes, ExrBytes(images.sh));
  outputs[3].name = stem + ".variance.exr";
  BAKEWELL_ASSIGN_OR_RETURN(outputs[3].bytes, ExrBytes(images.variance));
  outputs[4] = {stem + ".charts.json", ChartsJson(page, SummarizeCharts(map, lights, page))};
  return outputs;
}

}  // namespace bakewell
