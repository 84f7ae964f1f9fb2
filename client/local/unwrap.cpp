#include "client/local/unwrap.h"

#include <chrono>
#include <ctime>

#include "client/gltf/level.h"
#include "core/artifact/atomic_file.h"
#include "core/image/png.h"
#include "server/chart/atlas.h"
#include "server/chart/generate.h"
#include "server/chart/obj.h"
#include "server/chart/picture.h"

namespace bakewell {
namespace {

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

UnwrapReport Report(const chart::Atlas& atlas, const Timings& timings) {
  UnwrapReport report{.charts = atlas.chartCount,
                      .pages = atlas.atlasCount,
                      .width = atlas.width,
                      .height = atlas.height,
                      .texels_per_unit = atlas.texelsPerUnit,
                      .chart_cpu_s = timings.chart_cpu_s,
                      .pack_cpu_s = timings.pack_cpu_s,
                      .wall_s = timings.wall_s,
                      .warnings = {}};
  for (const chart::Mesh& mesh : atlas.meshes) {
    report.triangles += static_cast<int64_t>(mesh.faceState.size());
    for (const chart::FaceState state : mesh.faceState) report.set_aside += state != chart::FaceState::kCharted;
  }
  for (const float utilization : atlas.utilization) report.mean_utilization += utilization / double(report.pages);
  return report;
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

absl::StatusOr<UnwrapReport> UnwrapObj(const UnwrapRequest& request) {
  BAKEWELL_ASSIGN_OR_RETURN(const chart::ObjMesh mesh, chart::ReadObj(request.input));
  const chart::MeshDecl decl{.vertexPositionData = mesh.position, .vertexUvData = {}, .indexData = mesh.index};
  Timings timings;
  BAKEWELL_ASSIGN_OR_RETURN(const chart::Atlas atlas, MakeAtlas(std::span(&decl, 1), request, timings));
  BAKEWELL_RETURN_IF_ERROR(WriteFileAtomically(request.output, chart::FormatObj(mesh, atlas)));
  const int first = 0;
  if (!request.picture.empty())
    BAKEWELL_RETURN_IF_ERROR(WritePictures(request.picture, ToLayout(atlas, std::span(&first, 1))));
  return Report(atlas, timings);
}

absl::StatusOr<UnwrapReport> UnwrapLevel(const UnwrapRequest& request) {
  BAKEWELL_ASSIGN_OR_RETURN(const LoadedLevel level, LoadLevel(request.input));
  std::vector<chart::MeshDecl> meshes;
  std::vector<int> mesh_of_object;
  for (const Object& object : level.scene.objects) {
    mesh_of_object.push_back(object.lightmapped ? static_cast<int>(meshes.size()) : -1);
    if (!object.lightmapped) continue;
    meshes.push_back({.vertexPositionData = object.position,
                      .vertexUvData = request.chart.useInputMeshUvs ? std::span(object.uv1) : std::span<const Vec2f>(),
                      .indexData = object.index,
                      .density = object.density});
  }
  Timings timings;
  BAKEWELL_ASSIGN_OR_RETURN(const chart::Atlas atlas, MakeAtlas(meshes, request, timings));
  const AtlasLayout layout = ToLayout(atlas, mesh_of_object);
  const std::vector<LightmapFiles> no_files(layout.pages.size());
  BAKEWELL_RETURN_IF_ERROR(WriteLevel(request.input, level, layout, no_files, request.output));
  if (!request.picture.empty()) BAKEWELL_RETURN_IF_ERROR(WritePictures(request.picture, layout));
  UnwrapReport report = Report(atlas, timings);
  report.warnings = level.warnings;
  return report;
}

}  // namespace

absl::StatusOr<UnwrapReport> Unwrap(const UnwrapRequest& request) {
  if (request.input.extension() == ".obj" && request.output.extension() == ".obj") return UnwrapObj(request);
  const bool level_in = request.input.extension() == ".glb" || request.input.extension() == ".gltf";
  if (level_in && request.output.extension() == ".glb") return UnwrapLevel(request);
  return absl::InvalidArgumentError(request.input.string() + " -> " + request.output.string() +
                                    ": both must be .obj or both .glb");
}

}  // namespace bakewell
