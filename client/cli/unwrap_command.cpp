#include <absl/strings/str_format.h>

#include <memory>

#include "client/cli/commands.h"
#include "core/artifact/json_line.h"

namespace bakewell {
namespace {

struct UnwrapFlags {
  UnwrapRequest request;
  bool json = false;
};

void PrintJson(const UnwrapReport& report, const Console& console) {
  JsonLine line;
  line.Add("triangles", report.triangles).Add("set_aside", report.set_aside);
  line.Add("charts", report.charts).Add("pages", report.pages);
  line.Add("width", report.width).Add("height", report.height);
  line.Add("texels_per_unit", report.texels_per_unit).Add("utilization", report.mean_utilization);
  line.Add("chart_cpu_s", report.chart_cpu_s).Add("pack_cpu_s", report.pack_cpu_s).Add("wall_s", report.wall_s);
  line.Add("warnings", report.warnings);
  console.out << line.Text() << std::endl;
}

void PrintText(const UnwrapReport& report, const Console& console) {
  for (const std::string& warning : report.warnings) console.err << "warning: " << warning << std::endl;
  console.out << absl::StrFormat(
      "%d triangles in %d charts on %d page(s) of %d x %d, %.1f %% full, %.4g texels per unit\n",
      report.triangles - report.set_aside, report.charts, report.pages, report.width, report.height,
      100 * report.mean_utilization, report.texels_per_unit);
  if (report.set_aside > 0)
    console.out << absl::StrFormat("%d triangles have no area or no finite position, and no chart\n", report.set_aside);
}

int RunUnwrap(const UnwrapFlags& flags, const Console& console, const Bakers& bakers) {
  const absl::StatusOr<UnwrapReport> report = bakers.unwrap(flags.request);
  if (!report.ok()) return ReportError(report.status(), flags.json ? OutputForm::kJson : OutputForm::kText, console);
  flags.json ? PrintJson(*report, console) : PrintText(*report, console);
  return 0;
}

void AddChartFlags(CLI::App& command, chart::ChartOptions& options) {
  command.add_option("--max-chart-area", options.maxChartArea, "No chart grows beyond this area; 0: no limit");
  command.add_option("--max-boundary-length", options.maxBoundaryLength, "... nor beyond this outline; 0: no limit");
  command.add_option("--normal-deviation-weight", options.normalDeviationWeight, "Cost of turning normals");
  command.add_option("--roundness-weight", options.roundnessWeight, "Cost of long outlines");
  command.add_option("--straightness-weight", options.straightnessWeight, "Cost of ragged borders");
  command.add_option("--normal-seam-weight", options.normalSeamWeight, "Cost of sharp edges inside a chart");
  command.add_option("--texture-seam-weight", options.textureSeamWeight, "Cost of input UV seams inside a chart");
  command.add_option("--max-cost", options.maxCost, "Charts stop growing above this cost");
  command.add_option("--max-iterations", options.maxIterations, "Passes that straighten borders");
  command.add_flag("--use-input-mesh-uvs", options.useInputMeshUvs, "Keep the input's UV charts where valid");
  command.add_flag("--fix-winding", options.fixWinding, "For compatibility: UVs always run counter-clockwise");
  command.add_option("--max-stretch", options.maxStretch, "Bound of a chart's Sander L2 stretch")
      ->check(CLI::Range(1.0001, 1e6));
}

void AddPackFlags(CLI::App& command, chart::PackOptions& options) {
  command.add_option("--max-chart-size", options.maxChartSize, "Longer charts are scaled down [texels]; 0: the page");
  command.add_option("--padding", options.padding, "Empty texels between any two charts");
  command.add_option("--texels-per-unit", options.texelsPerUnit, "Density; 0: as large as fills one page");
  command.add_option("--resolution", options.resolution, "Page side, never exceeded [texels]; 0: chosen");
  command.add_option("--max-resolution", options.maxResolution,
                     "Longest page side where the density is given and the resolution is not; 0: 8192");
  command.add_flag("--bilinear,!--no-bilinear", options.bilinear, "Keep bilinear filtering inside a chart's gutter");
  command.add_flag("--block-align,!--no-block-align", options.blockAlign, "No two charts share a 4x4 block");
  command.add_flag("--brute-force,!--no-brute-force", options.bruteForce, "Search longer for a denser packing");
  command.add_flag("--rotate-charts,!--no-rotate-charts", options.rotateCharts, "Try quarter turns");
  command.add_flag("--rotate-charts-to-axis,!--no-rotate-charts-to-axis", options.rotateChartsToAxis,
                   "Turn charts upright");
}

}  // namespace

void AddUnwrapCommand(CLI::App& app, const Console& console, const Bakers& bakers, int* exit_code) {
  CLI::App* command = app.add_subcommand("unwrap", "Gives a mesh or a level lightmap UVs");
  const auto flags = std::make_shared<UnwrapFlags>();
  command->add_option("input", flags->request.input, "in.obj, in.glb or in.gltf")->required();
  command->add_option("-o,--output", flags->request.output, "out.obj or out.glb")->required();
  command->add_option("--picture", flags->request.picture, "PNG of the pages, charts coloured");
  command->add_flag("--json", flags->json, "Print one JSON object a line");
  AddChartFlags(*command, flags->request.chart);
  AddPackFlags(*command, flags->request.pack);
  command->callback([=, &console, &bakers] { *exit_code = RunUnwrap(*flags, console, bakers); });
}

}  // namespace bakewell
