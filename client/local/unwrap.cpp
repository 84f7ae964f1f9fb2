#include "client/local/unwrap.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "server/chart/atlas.h"
#include "server/chart/obj.h"

namespace bakewell {
namespace {

// Whole or not at all: the text goes to a neighbour that is then renamed.
absl::Status WriteWhole(const std::filesystem::path& path, const std::string& text) {
  const std::filesystem::path part = path.string() + ".part";
  {
    std::ofstream file(part, std::ios::binary);
    file << text;
    file.close();
    if (!file) return absl::UnavailableError(part.string() + ": cannot be written");
  }
  std::error_code error;
  std::filesystem::rename(part, path, error);
  if (error) return absl::UnavailableError(path.string() + ": " + error.message());
  return absl::OkStatus();
}

// CPU seconds of the whole process, and wall seconds, since its making.
class Stopwatch {
 public:
  double CpuSeconds() const { return double(std::clock() - cpu_) / CLOCKS_PER_SEC; }
  double WallSeconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_).count(); }

 private:
  std::clock_t cpu_ = std::clock();
  std::chrono::steady_clock::time_point wall_ = std::chrono::steady_clock::now();
};

struct Timings {
  double chart_cpu_s = 0, pack_cpu_s = 0, wall_s = 0;
};

nlohmann::json Report(const chart::Atlas& atlas, const Timings& timings) {
  size_t triangles = 0, charted = 0;
  for (const chart::Mesh& mesh : atlas.meshes) {
    triangles += mesh.faceState.size();
    charted +=
        static_cast<size_t>(std::count(mesh.faceState.begin(), mesh.faceState.end(), chart::FaceState::kCharted));
  }
  return {{"triangles", triangles},
          {"set_aside", triangles - charted},
          {"charts", atlas.chartCount},
          {"pages", atlas.atlasCount},
          {"width", atlas.width},
          {"height", atlas.height},
          {"texels_per_unit", atlas.texelsPerUnit},
          {"utilization", atlas.utilization},
          {"chart_cpu_s", timings.chart_cpu_s},
          {"pack_cpu_s", timings.pack_cpu_s},
          {"wall_s", timings.wall_s}};
}

void Print(const nlohmann::json& report, bool json) {
  if (json) {
    std::cout << report.dump() << std::endl;
    return;
  }
  std::cout << report["triangles"] << " triangles, " << report["charts"] << " charts on " << report["pages"]
            << " page(s) of " << report["width"] << " x " << report["height"] << ", " << report["texels_per_unit"]
            << " texels per unit, " << report["set_aside"] << " triangles without a chart" << std::endl;
}

absl::Status UnwrapObj(const UnwrapRequest& request) {
  BAKEWELL_ASSIGN_OR_RETURN(const chart::ObjMesh mesh, chart::ReadObj(request.input));
  const chart::MeshDecl decl{.vertexPositionData = mesh.position, .vertexUvData = {}, .indexData = mesh.index};
  Timings timings;
  const Stopwatch all, charting;
  BAKEWELL_ASSIGN_OR_RETURN(const auto charts, chart::ComputeCharts(std::span(&decl, 1), request.chart));
  timings.chart_cpu_s = charting.CpuSeconds();
  const Stopwatch packing;
  BAKEWELL_ASSIGN_OR_RETURN(const chart::Atlas atlas, chart::PackCharts(std::span(&decl, 1), charts, request.pack));
  timings.pack_cpu_s = packing.CpuSeconds();
  timings.wall_s = all.WallSeconds();
  BAKEWELL_RETURN_IF_ERROR(WriteWhole(request.output, chart::FormatObj(mesh, atlas)));
  Print(Report(atlas, timings), request.json);
  return absl::OkStatus();
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
  command.add_flag("--fix-winding", options.fixWinding, "Turn faces so that neighbours agree");
  command.add_option("--max-stretch", options.maxStretch, "Bound of a chart's Sander L2 stretch")
      ->check(CLI::Range(1.0001, 1e6));
}

void AddPackFlags(CLI::App& command, chart::PackOptions& options) {
  command.add_option("--max-chart-size", options.maxChartSize, "Longer charts are scaled down [texels]; 0: the page");
  command.add_option("--padding", options.padding, "Empty texels between any two charts");
  command.add_option("--texels-per-unit", options.texelsPerUnit, "Density; 0: as large as fills one page");
  command.add_option("--resolution", options.resolution, "Page side, never exceeded [texels]; 0: chosen");
  command.add_flag("--bilinear,!--no-bilinear", options.bilinear, "Keep bilinear filtering inside a chart's gutter");
  command.add_flag("--block-align,!--no-block-align", options.blockAlign, "No two charts share a 4x4 block");
  command.add_flag("--brute-force,!--no-brute-force", options.bruteForce, "Search longer for a denser packing");
  command.add_flag("--rotate-charts,!--no-rotate-charts", options.rotateCharts, "Try quarter turns");
  command.add_flag("--rotate-charts-to-axis,!--no-rotate-charts-to-axis", options.rotateChartsToAxis,
                   "Turn charts upright");
}

}  // namespace

absl::Status Unwrap(const UnwrapRequest& request) {
  if (request.input.extension() == ".obj" && request.output.extension() == ".obj") return UnwrapObj(request);
  return absl::InvalidArgumentError(request.input.string() + " -> " + request.output.string() +
                                    ": both must be .obj or both .glb");
}

void RegisterUnwrap(CLI::App& program, int& exit_code) {
  CLI::App* command = program.add_subcommand("unwrap", "Give a mesh lightmap UVs");
  const auto request = std::make_shared<UnwrapRequest>();
  command->add_option("input", request->input, "in.obj or in.glb")->required();
  command->add_option("-o,--output", request->output, "out.obj or out.glb")->required();
  command->add_option("--picture", request->picture, "PNG of the pages, charts coloured");
  command->add_flag("--json", request->json, "Print one JSON object");
  AddChartFlags(*command, request->chart);
  AddPackFlags(*command, request->pack);
  command->callback([request, &exit_code] {
    const absl::Status status = Unwrap(*request);
    if (!status.ok()) std::cerr << "bakewell unwrap: " << status.message() << std::endl;
    exit_code = status.ok() ? 0 : 2;
  });
}

}  // namespace bakewell
