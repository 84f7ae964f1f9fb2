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

#include "client/gltf/level.h"
#include "core/image/png.h"
#include "server/chart/atlas.h"
#include "server/chart/generate.h"
#include "server/chart/obj.h"
#include "server/chart/picture.h"

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

// Charts and packs, and says how long each took.
absl::StatusOr<chart::Atlas> MakeAtlas(std::span<const chart::MeshDecl> meshes, const UnwrapRequest& request,
                                       Timings& timings) {
  const Stopwatch charting;
  BAKEWELL_ASSIGN_OR_RETURN(const auto charts, chart::ComputeCharts(meshes, request.chart));
  timings.chart_cpu_s = charting.CpuSeconds();
  const Stopwatch packing;
  BAKEWELL_ASSIGN_OR_RETURN(chart::Atlas atlas, chart::PackCharts(meshes, charts, request.pack));
  timings.pack_cpu_s = packing.CpuSeconds();
  timings.wall_s = charting.WallSeconds();
  return atlas;
}

// name.png, or name-0.png, name-1.png, ... for several pages.
absl::Status WritePictures(const std::filesystem::path& path, const AtlasLayout& layout) {
  for (int page = 0; page < static_cast<int>(layout.pages.size()); ++page) {
    std::filesystem::path file = path;
    if (layout.pages.size() > 1)
      file.replace_filename(path.stem().string() + "-" + std::to_string(page) + path.extension().string());
    const PageSize size = layout.pages[page];
    BAKEWELL_RETURN_IF_ERROR(WritePng(file, size.width, size.height, DrawCharts(layout, page)));
  }
  return absl::OkStatus();
}

absl::Status UnwrapObj(const UnwrapRequest& request) {
  BAKEWELL_ASSIGN_OR_RETURN(const chart::ObjMesh mesh, chart::ReadObj(request.input));
  const chart::MeshDecl decl{.vertexPositionData = mesh.position, .vertexUvData = {}, .indexData = mesh.index};
  Timings timings;
  BAKEWELL_ASSIGN_OR_RETURN(const chart::Atlas atlas, MakeAtlas(std::span(&decl, 1), request, timings));
  BAKEWELL_RETURN_IF_ERROR(WriteWhole(request.output, chart::FormatObj(mesh, atlas)));
  const int first = 0;
  if (!request.picture.empty())
    BAKEWELL_RETURN_IF_ERROR(WritePictures(request.picture, ToLayout(atlas, std::span(&first, 1))));
  Print(Report(atlas, timings), request.json);
  return absl::OkStatus();
}

absl::Status UnwrapLevel(const UnwrapRequest& request) {
  BAKEWELL_ASSIGN_OR_RETURN(const LoadedLevel level, LoadLevel(request.input));
  std::vector<chart::MeshDecl> meshes;
  std::vector<int> mesh_of_object;
  for (const Object& object : level.scene.objects) {
    mesh_of_object.push_back(object.lightmapped ? static_cast<int>(meshes.size()) : -1);
    if (!object.lightmapped) continue;
    meshes.push_back({.vertexPositionData = object.position,
                      .vertexUvData = object.uv1,
                      .indexData = object.index,
                      .density = object.density});
  }
  Timings timings;
  BAKEWELL_ASSIGN_OR_RETURN(const chart::Atlas atlas, MakeAtlas(meshes, request, timings));
  const AtlasLayout layout = ToLayout(atlas, mesh_of_object);
  const std::vector<LightmapFiles> no_files(layout.pages.size());
  BAKEWELL_RETURN_IF_ERROR(WriteLevel(request.input, level, layout, no_files, request.output));
  if (!request.picture.empty()) BAKEWELL_RETURN_IF_ERROR(WritePictures(request.picture, layout));
  for (const std::string& warning : level.warnings) std::cerr << "warning: " << warning << std::endl;
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
  command.add_flag("--fix-winding", options.fixWinding, "For compatibility: UVs always run counter-clockwise");
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
  const bool level_in = request.input.extension() == ".glb" || request.input.extension() == ".gltf";
  if (level_in && request.output.extension() == ".glb") return UnwrapLevel(request);
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
