#include "client/gltf/level.h"

#include <absl/strings/str_cat.h>

#include <exception>
#include <map>
#include <numeric>
#include <set>
#include <tuple>

#include "client/gltf/file/output.h"
#include "client/gltf/file/placement.h"
#include "client/gltf/file/schema.h"
#include "client/gltf/primitive.h"
#include "core/artifact/atomic_file.h"
#include "core/base/check.h"

namespace bakewell {
namespace gltf {
namespace {

using nlohmann::json;

constexpr const char* kInstancing = "EXT_mesh_gpu_instancing";

// A mesh in one place: a node (instance -1), or one of a node's instances.
struct Place {
  int node = 0, instance = -1;
  friend auto operator<=>(const Place&, const Place&) = default;
};

// The vertices and triangles of an object that lie on one page.
struct PagePart {
  int page = 0;
  std::vector<uint32_t> vertex;  // charted vertices, in order of first use
  std::vector<uint32_t> index;   // into `vertex`
};

bool Collapsed(std::span<const uint32_t> triangle) {
  return triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0];
}

// Splits by page, first pages first. Triangles without a chart go with the first; collapsed ones (bad triangles of the
// input) draw nothing and are left out.
std::vector<PagePart> SplitByPage(const ObjectCharts& charts, const AtlasLayout& layout) {
  const auto page_of = [&](size_t t) {
    const int32_t chart = charts.chart_of_triangle[t];
    return chart == kNoChart ? -1 : layout.charts[static_cast<size_t>(chart)].page;
  };
  std::set<int> pages;
  for (size_t t = 0; t < charts.chart_of_triangle.size(); ++t) pages.insert(page_of(t));
  pages.erase(-1);
  std::vector<PagePart> parts;
  for (const int page : pages) {
    PagePart part{page, {}, {}};
    std::map<uint32_t, uint32_t> number;
    for (size_t t = 0; t < charts.chart_of_triangle.size(); ++t) {
      const int at = page_of(t) < 0 ? *pages.begin() : page_of(t);
      const auto corners = std::span(charts.index).subspan(3 * t, 3);
      if (at != page || Collapsed(corners)) continue;
      for (const uint32_t corner : corners) {
        const auto [it, added] = number.try_emplace(corner, static_cast<uint32_t>(part.vertex.size()));
        if (added) part.vertex.push_back(corner);
        part.index.push_back(it->second);
      }
    }
    if (!part.index.empty()) parts.push_back(std::move(part));
  }
  return parts;
}

void CheckLayout(const LoadedLevel& level, const AtlasLayout& layout, std::span<const LightmapFiles> files) {
  BAKEWELL_CHECK_OP(layout.objects.size(), ==, level.scene.objects.size());
  BAKEWELL_CHECK_OP(files.size(), ==, layout.pages.size());
  for (size_t i = 0; i < layout.objects.size(); ++i) {
    const ObjectCharts& charts = layout.objects[i];
    if (charts.index.empty()) continue;
    BAKEWELL_CHECK_OP(charts.index.size(), ==, level.scene.objects[i].index.size());
    BAKEWELL_CHECK_OP(charts.index.size(), ==, 3 * charts.chart_of_triangle.size());
    BAKEWELL_CHECK_OP(charts.uv.size(), ==, charts.xref.size());
  }
}

class LevelWriter {
 public:
  LevelWriter(const Source& source, const LoadedLevel& level, const AtlasLayout& layout,
              std::span<const LightmapFiles> files)
      : source_(source), level_(level), layout_(layout), files_(files) {}

  absl::StatusOr<std::string> Write() {
    BAKEWELL_ASSIGN_OR_RETURN(output_, Output::From(source_.document));
    BAKEWELL_ASSIGN_OR_RETURN(const std::vector<PlacedNode> nodes, PlaceNodes(source_));
    CollectObjects();
    for (const PlacedNode& node : nodes) BAKEWELL_RETURN_IF_ERROR(WriteNode(node));
    DropUnusedInstancing();
    return output_.Glb();
  }

 private:
  struct Charted {
    int primitive = 0;
    const ObjectCharts* charts = nullptr;
  };

  void CollectObjects() {
    for (size_t i = 0; i < layout_.objects.size(); ++i) {
      const ObjectSource& source = level_.scene.objects[i].source;
      if (layout_.objects[i].index.empty()) continue;
      objects_[{source.node, source.instance}].push_back({source.primitive, &layout_.objects[i]});
    }
  }

  json& NodeJson(int node) { return output_.json["nodes"][static_cast<size_t>(node)]; }

  absl::Status WriteNode(const PlacedNode& placed) {
    const auto first = objects_.lower_bound({placed.node, -1});
    if (first == objects_.end() || first->first.node != placed.node) return absl::OkStatus();
    if (first->first.instance < 0) {
      return WriteMesh(placed.node, first->second, placed.node, placed.world_from_node.Mirrors());
    }
    return ExpandInstances(placed);
  }

  // One child per instance, in the place of the extension.
  absl::Status ExpandInstances(const PlacedNode& placed) {
    BAKEWELL_ASSIGN_OR_RETURN(const Instances instances, ReadInstances(source_, placed.node));
    const json original = NodeJson(placed.node);
    NodeJson(placed.node).erase("mesh");
    NodeJson(placed.node)["extensions"].erase(kInstancing);
    if (NodeJson(placed.node)["extensions"].empty()) NodeJson(placed.node).erase("extensions");
    for (size_t i = 0; i < instances.node_from_instance.size(); ++i) {
      json child = NodeOfInstance(instances, i);
      child["mesh"] = original["mesh"];
      child["name"] = absl::StrCat(StringOr(original, {"name"}, "instance"), ".", i);
      if (const json* density = Find(original, {"extras", "lightmapDensity"})) {
        child["extras"]["lightmapDensity"] = *density;
      }
      const int node = output_.Push("nodes", std::move(child));
      NodeJson(placed.node)["children"].push_back(node);
      const auto objects = objects_.find({placed.node, static_cast<int>(i)});
      if (objects == objects_.end()) continue;
      const bool mirrored = (placed.world_from_node * instances.node_from_instance[i]).Mirrors();
      BAKEWELL_RETURN_IF_ERROR(WriteMesh(placed.node, objects->second, node, mirrored));
    }
    return absl::OkStatus();
  }

  // Gives `node` of the output its own copy of the mesh of `source_node`, with these primitives replaced.
  absl::Status WriteMesh(int source_node, const std::vector<Charted>& objects, int node, bool mirrored) {
    const int mesh = source_.model.nodes[static_cast<size_t>(source_node)].mesh;
    std::map<int, std::vector<json>> replaced;
    std::set<int> pages;
    for (const Charted& object : objects) {
      for (const PagePart& part : SplitByPage(*object.charts, layout_)) {
        BAKEWELL_ASSIGN_OR_RETURN(json primitive, WritePart(mesh, object, part, mirrored));
        ExtrasOf(primitive)["lightmap"] = LightmapOf(part.page);
        replaced[object.primitive].push_back(std::move(primitive));
        pages.insert(part.page);
      }
    }
    if (pages.empty()) return absl::OkStatus();
    json copy = output_.json["meshes"][static_cast<size_t>(mesh)];
    copy["primitives"] = Replace(copy["primitives"], replaced, pages.size() == 1);
    NodeJson(node)["mesh"] = output_.Push("meshes", std::move(copy));
    ExtrasOf(NodeJson(node))["lightmap"] = LightmapOf(*pages.begin());
    return absl::OkStatus();
  }

  // The mesh's primitives with replacements put in place. On one page the node says all there is to say.
  static json Replace(const json& primitives, const std::map<int, std::vector<json>>& replaced, bool one_page) {
    json result = json::array();
    for (size_t p = 0; p < primitives.size(); ++p) {
      const auto it = replaced.find(static_cast<int>(p));
      if (it == replaced.end()) result.push_back(primitives[p]);
      for (json primitive : it == replaced.end() ? std::vector<json>() : it->second) {
        if (one_page) primitive["extras"].erase("lightmap");
        if (primitive["extras"].empty()) primitive.erase("extras");
        result.push_back(std::move(primitive));
      }
    }
    return result;
  }

  json LightmapOf(int page) const {
    const LightmapFiles& files = files_[static_cast<size_t>(page)];
    json lightmap = {{"page", page}, {"texCoord", 1}};
    if (!files.irradiance.empty()) lightmap["irradiance"] = files.irradiance;
    if (!files.sh.empty()) lightmap["sh"] = files.sh;
    if (!files.variance.empty()) lightmap["variance"] = files.variance;
    return lightmap;
  }

  absl::StatusOr<json> WritePart(int mesh, const Charted& object, const PagePart& part, bool mirrored) {
    json primitive =
        source_.document.json["meshes"][static_cast<size_t>(mesh)]["primitives"][static_cast<size_t>(object.primitive)];
    BAKEWELL_ASSIGN_OR_RETURN(std::vector<uint32_t> vertices, SourceVertices(mesh, object, part));
    BAKEWELL_ASSIGN_OR_RETURN(primitive["attributes"], AttributesOf(mesh, object.primitive, std::move(vertices)));
    primitive["attributes"]["TEXCOORD_1"] = output_.AddVec2(UvsOf(object, part));
    std::vector<uint32_t> index = part.index;
    // The loader turned the winding of mirrored geometry; the file's is the mesh's own.
    for (size_t t = 0; mirrored && t < index.size(); t += 3) std::swap(index[t + 1], index[t + 2]);
    primitive["indices"] = output_.AddIndices(index);
    primitive["mode"] = TINYGLTF_MODE_TRIANGLES;
    if (primitive.contains("extensions")) primitive["extensions"].erase("KHR_draco_mesh_compression");
    return primitive;
  }

  // Which vertex of the file each vertex of the part is.
  absl::StatusOr<std::vector<uint32_t>> SourceVertices(int mesh, const Charted& object, const PagePart& part) const {
    std::vector<uint32_t> unshared;
    if (!HasNormals(source_, mesh, object.primitive)) {
      BAKEWELL_ASSIGN_OR_RETURN(unshared, ReadTriangles(source_, mesh, object.primitive));
    }
    std::vector<uint32_t> vertices;
    for (const uint32_t charted : part.vertex) {
      const uint32_t of_object = object.charts->xref[charted];
      vertices.push_back(unshared.empty() ? of_object : unshared[of_object]);
    }
    return vertices;
  }

  // Accessors of these vertices of every attribute but TEXCOORD_1; places that need the same ones share them.
  absl::StatusOr<json> AttributesOf(int mesh, int primitive, std::vector<uint32_t> vertices) {
    const auto key = std::make_tuple(mesh, primitive, std::move(vertices));
    if (const auto it = attributes_.find(key); it != attributes_.end()) return it->second;
    const auto& which = std::get<2>(key);
    json attributes = json::object();
    const auto& source = source_.model.meshes[static_cast<size_t>(mesh)].primitives[static_cast<size_t>(primitive)];
    for (const auto& [name, accessor] : source.attributes) {
      if (name == "TEXCOORD_1") continue;
      BAKEWELL_ASSIGN_OR_RETURN(attributes[name], GatherAttribute(accessor, which));
    }
    return attributes_[key] = attributes;
  }

  absl::StatusOr<int> GatherAttribute(int accessor, const std::vector<uint32_t>& which) {
    const size_t count = source_.model.accessors[static_cast<size_t>(accessor)].count;
    std::vector<uint32_t> all(which.size());
    std::iota(all.begin(), all.end(), 0u);
    if (which.size() == count && which == all) return accessor;
    for (const uint32_t vertex : which) {
      if (vertex >= count) return absl::InvalidArgumentError("an attribute is shorter than POSITION");
    }
    BAKEWELL_ASSIGN_OR_RETURN(const Elements elements, GatherElements(source_, accessor, which));
    return output_.AddElements(elements, which.size());
  }

  std::vector<Vec2f> UvsOf(const Charted& object, const PagePart& part) const {
    const PageSize size = layout_.pages[static_cast<size_t>(part.page)];
    std::vector<Vec2f> uvs;
    for (const uint32_t charted : part.vertex) {
      const TexelUv uv = object.charts->uv[charted];
      uvs.push_back({uv.x / static_cast<float>(size.width), uv.y / static_cast<float>(size.height)});
    }
    return uvs;
  }

  // Names the extension no more where every use of it has been expanded.
  void DropUnusedInstancing() {
    for (const json& node : output_.json.value("nodes", json::array())) {
      if (Find(node, {"extensions", kInstancing})) return;
    }
    for (const char* list : {"extensionsUsed", "extensionsRequired"}) {
      if (!output_.json.contains(list)) continue;
      json kept = json::array();
      for (const json& name : output_.json[list]) {
        if (name != kInstancing) kept.push_back(name);
      }
      output_.json[list] = kept;
      if (kept.empty()) output_.json.erase(list);
    }
  }

  const Source& source_;
  const LoadedLevel& level_;
  const AtlasLayout& layout_;
  std::span<const LightmapFiles> files_;
  Output output_;
  std::map<Place, std::vector<Charted>> objects_;
  std::map<std::tuple<int, int, std::vector<uint32_t>>, json> attributes_;
};

absl::StatusOr<std::string> Rewrite(const std::filesystem::path& path_in, const LoadedLevel& level,
                                    const AtlasLayout& layout, std::span<const LightmapFiles> files) {
  try {
    BAKEWELL_ASSIGN_OR_RETURN(const Source source, ReadSource(path_in));
    if (source.document.digest != level.file_digest) {
      return absl::FailedPreconditionError("the file has changed since it was read");
    }
    return LevelWriter(source, level, layout, files).Write();
  } catch (const std::exception& exception) {
    return absl::InvalidArgumentError(exception.what());
  }
}

}  // namespace
}  // namespace gltf

absl::Status WriteLevel(const std::filesystem::path& path_in, const LoadedLevel& level, const AtlasLayout& layout,
                        std::span<const LightmapFiles> files, const std::filesystem::path& path_out) {
  gltf::CheckLayout(level, layout, files);
  const auto glb = gltf::Rewrite(path_in, level, layout, files);
  if (!glb.ok()) return absl::Status(glb.status().code(), absl::StrCat(path_in.string(), ": ", glb.status().message()));
  return WriteFileAtomically(path_out, *glb);
}

}  // namespace bakewell
