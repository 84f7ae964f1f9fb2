#include "client/gltf/level.h"

#include <absl/strings/str_cat.h>

#include <exception>
#include <map>

#include "client/gltf/features.h"
#include "client/gltf/file/placement.h"
#include "client/gltf/file/schema.h"
#include "client/gltf/light.h"
#include "client/gltf/material.h"
#include "client/gltf/object.h"
#include "client/gltf/primitive.h"
#include "core/scene/canonical.h"

namespace bakewell {
namespace gltf {
namespace {

using nlohmann::json;

// Loads one level; each step fills in its part of `level_`.
class LevelLoader {
 public:
  LevelLoader(const Source& source, const LoadLimits& limits)
      : source_(source), limits_(limits), materials_(source, limits, level_.scene, warnings_) {}

  absl::StatusOr<LoadedLevel> Load() {
    BAKEWELL_RETURN_IF_ERROR(CheckFeatures(source_, warnings_));
    BAKEWELL_ASSIGN_OR_RETURN(const std::vector<PlacedNode> nodes, PlaceNodes(source_));
    for (const PlacedNode& node : nodes) BAKEWELL_RETURN_IF_ERROR(Charge(node.node));
    for (const PlacedNode& node : nodes) BAKEWELL_RETURN_IF_ERROR(AddNode(node));
    BAKEWELL_ASSIGN_OR_RETURN(const auto lights, ReadLights(source_, nodes, warnings_));
    BAKEWELL_ASSIGN_OR_RETURN(level_.scene.environment, ReadEnvironment(source_));
    BAKEWELL_ASSIGN_OR_RETURN(level_.scene.lightmap_page, ReadPageHint(source_));
    Finish(lights);
    level_.file_digest = source_.document.digest;
    level_.warnings = warnings_.Take();
    Canonicalize(level_.scene);
    return std::move(level_);
  }

 private:
  absl::Status AddNode(const PlacedNode& placed) {
    const tinygltf::Node& node = source_.model.nodes[static_cast<size_t>(placed.node)];
    if (node.mesh < 0) return absl::OkStatus();
    const std::string name = NameOf(source_.document.json, "nodes", placed.node);
    if (node.skin >= 0) {
      warnings_.Add(name + ": skinned meshes are skipped");
      return absl::OkStatus();
    }
    BAKEWELL_ASSIGN_OR_RETURN(const Instances instances, ReadInstances(source_, placed.node));
    if (!instances.present) return AddMesh(placed.node, -1, placed.world_from_node);
    for (size_t i = 0; i < instances.node_from_instance.size(); ++i) {
      const Transform world = placed.world_from_node * instances.node_from_instance[i];
      if (!world.Finite()) return absl::InvalidArgumentError(absl::StrCat(name, ": instance ", i, " is not finite"));
      BAKEWELL_RETURN_IF_ERROR(AddMesh(placed.node, static_cast<int>(i), world));
    }
    return absl::OkStatus();
  }

  absl::Status AddMesh(int node, int instance, const Transform& world) {
    const int mesh = source_.model.nodes[static_cast<size_t>(node)].mesh;
    const size_t count = source_.model.meshes[static_cast<size_t>(mesh)].primitives.size();
    for (size_t p = 0; p < count; ++p) {
      const ObjectSource source{node, mesh, static_cast<int>(p), instance};
      if (const auto reason = SkipReason(source_, mesh, source.primitive)) {
        warnings_.Add(absl::StrCat(NameOf(source_.document.json, "meshes", mesh), ": primitives[", p, "] ", *reason,
                                   " and is skipped"));
        continue;
      }
      BAKEWELL_RETURN_IF_ERROR(AddPrimitive(source, world));
    }
    return absl::OkStatus();
  }

  absl::Status AddPrimitive(const ObjectSource& source, const Transform& world) {
    BAKEWELL_ASSIGN_OR_RETURN(const PrimitiveData* data, DataOf(source.mesh, source.primitive));
    WorldObject object = PlaceObject(*data, world);
    object.object.source = source;
    BAKEWELL_RETURN_IF_ERROR(ReadNodeExtras(source, object.object));
    const int material = source_.model.meshes[static_cast<size_t>(source.mesh)]
                             .primitives[static_cast<size_t>(source.primitive)]
                             .material;
    BAKEWELL_ASSIGN_OR_RETURN(object.object.material, materials_.Read(material));
    object.report.lacks_uv0 = data->uv0.empty() && UsesTexture(object.object.material);
    object.report.lacks_uv1 = data->uv1.empty() && object.object.lightmapped;
    objects_.push_back(std::move(object));
    return absl::OkStatus();
  }

  // Adds a node's mesh to what the scene will have, before anything is allocated for it.
  absl::Status Charge(int node) {
    const int mesh = source_.model.nodes[static_cast<size_t>(node)].mesh;
    if (mesh < 0) return absl::OkStatus();
    const uint64_t count = InstanceCount(source_, node);
    const size_t primitives = source_.model.meshes[static_cast<size_t>(mesh)].primitives.size();
    for (int p = 0; p < static_cast<int>(primitives); ++p) {
      if (SkipReason(source_, mesh, p)) continue;
      BAKEWELL_ASSIGN_OR_RETURN(const PrimitiveSize size, SizeOf(source_, mesh, p));
      triangles_ += static_cast<double>(count) * static_cast<double>(size.indices / 3);
      vertices_ +=
          static_cast<double>(count) * static_cast<double>(HasNormals(source_, mesh, p) ? size.vertices : size.indices);
    }
    if (triangles_ <= static_cast<double>(limits_.max_triangles) &&
        vertices_ <= static_cast<double>(limits_.max_vertices) &&
        count <= static_cast<uint64_t>(limits_.max_vertices)) {
      return absl::OkStatus();
    }
    return absl::InvalidArgumentError(absl::StrCat(NameOf(source_.document.json, "nodes", node),
                                                   ": with it the scene has ", triangles_, " triangles and ", vertices_,
                                                   " vertices in ", count, " instances, at most ",
                                                   limits_.max_triangles, " and ", limits_.max_vertices, " are read"));
  }

  absl::StatusOr<const PrimitiveData*> DataOf(int mesh, int primitive) {
    const auto key = std::make_pair(mesh, primitive);
    if (const auto it = data_.find(key); it != data_.end()) return &it->second;
    BAKEWELL_ASSIGN_OR_RETURN(PrimitiveData data, ReadPrimitive(source_, mesh, primitive));
    return &(data_[key] = std::move(data));
  }

  absl::Status ReadNodeExtras(const ObjectSource& source, Object& object) const {
    const json& document = source_.document.json;
    const json& node = document["nodes"][static_cast<size_t>(source.node)];
    const json& mesh = document["meshes"][static_cast<size_t>(source.mesh)];
    object.name = StringOr(node, {"name"}, "");
    if (object.name.empty()) object.name = StringOr(mesh, {"name"}, "");
    if (const json* lightmapped = Find(node, {"extras", "lightmapped"})) object.lightmapped = lightmapped->get<bool>();
    object.density = static_cast<float>(NumberOr(node, {"extras", "lightmapDensity"}, 1));
    if (object.density >= 1e-3f && object.density <= 1e3f) return absl::OkStatus();
    return absl::InvalidArgumentError(absl::StrCat(NameOf(document, "nodes", source.node), ": lightmapDensity ",
                                                   object.density, " is outside of [0.001, 1000]"));
  }

  bool UsesTexture(int material) const {
    const Material& m = level_.scene.materials[static_cast<size_t>(material)];
    const auto on_uv0 = [](const TextureRef& ref) { return ref.texture >= 0 && ref.texcoord == 0; };
    return on_uv0(m.base_texture) || on_uv0(m.emission_texture);
  }

  // Settles the origin, and makes everything relative to it.
  void Finish(const std::vector<PlacedLight>& lights) {
    MeanPoint mean;
    for (const WorldObject& object : objects_) AddTo(mean, object);
    Scene& scene = level_.scene;
    if (objects_.empty()) warnings_.Add("the scene has no triangles");
    scene.origin_ws = mean.Value();
    for (WorldObject& object : objects_) {
      FinishObject(object, scene.origin_ws);
      Report(object);
      scene.objects.push_back(std::move(object.object));
      object = {};
    }
    for (const PlacedLight& placed : lights) {
      scene.lights.push_back(placed.light);
      const bool has_position = placed.light.type != LightType::kDirectional;
      if (has_position) scene.lights.back().position = ToFloat(placed.position_ws - scene.origin_ws);
    }
  }

  void Report(WorldObject& world) {
    ObjectReport& report = world.report;
    const ObjectSource& source = world.object.source;
    report.object = absl::StrCat(NameOf(source_.document.json, "nodes", source.node), " primitives[", source.primitive,
                                 "]", source.instance < 0 ? "" : absl::StrCat(" instance ", source.instance));
    const auto warn = [&](int64_t count, const char* what) {
      if (count > 0) warnings_.Add(absl::StrCat(report.object, ": ", count, " ", what));
    };
    warn(report.non_finite, "triangles with coordinates that are not finite or beyond 10^9 m are left out");
    warn(report.degenerate, "triangles without area are left out");
    warn(report.duplicate, "triangles that repeat another one are left out");
    warn(report.bad_normals, "vertices without a usable NORMAL get the geometric one");
    warn(report.bad_uvs, "texture coordinates that are not finite become zero");
    warn(report.lacks_uv0, "primitive has a texture but no TEXCOORD_0");
    const bool any = report.non_finite + report.degenerate + report.duplicate + report.bad_normals + report.bad_uvs > 0;
    if (any || report.lacks_uv0 || report.lacks_uv1) level_.geometry.push_back(report);
  }

  const Source& source_;
  const LoadLimits& limits_;
  LoadedLevel level_;
  Warnings warnings_;
  MaterialReader materials_;
  std::map<std::pair<int, int>, PrimitiveData> data_;  // by mesh and primitive
  std::vector<WorldObject> objects_;
  double triangles_ = 0, vertices_ = 0;  // counts, in a type that does not overflow
};

}  // namespace

absl::StatusOr<LoadedLevel> Load(const std::filesystem::path& path, const LoadLimits& limits) {
  try {
    BAKEWELL_ASSIGN_OR_RETURN(const Source source, ReadSource(path));
    return LevelLoader(source, limits).Load();
  } catch (const std::exception& exception) {
    // What the JSON library throws where the schema let something through, and memory that is not there.
    return absl::InvalidArgumentError(exception.what());
  }
}

}  // namespace gltf

absl::StatusOr<LoadedLevel> LoadLevel(const std::filesystem::path& path, const LoadLimits& limits) {
  auto level = gltf::Load(path, limits);
  if (level.ok()) return level;
  const std::string name = path.string();
  const std::string message(level.status().message());
  const bool named = message.find(name) != std::string::npos;
  return absl::Status(level.status().code(), named ? message : absl::StrCat(name, ": ", message));
}

}  // namespace bakewell
