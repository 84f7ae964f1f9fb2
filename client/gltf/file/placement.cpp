#include "client/gltf/file/placement.h"

#include <absl/strings/str_cat.h>

#include <cmath>

#include "client/gltf/file/schema.h"

namespace bakewell::gltf {
namespace {

using nlohmann::json;

absl::Status ErrorAt(const Source& source, int node, absl::string_view reason) {
  return absl::InvalidArgumentError(absl::StrCat(NameOf(source.document.json, "nodes", node), ": ", reason));
}

const json& NodeJson(const Source& source, int node) {
  return source.document.json["nodes"][static_cast<size_t>(node)];
}

absl::StatusOr<Transform> WorldTransform(const Source& source, int node, const Transform& world_from_parent) {
  const auto local = LocalTransform(NodeJson(source, node));
  if (!local.ok()) return ErrorAt(source, node, local.status().message());
  const Transform world = world_from_parent * *local;
  if (!world.Finite()) return ErrorAt(source, node, "its transform is not finite");
  return world;
}

// One attribute of the extension: per instance `components` numbers, or none.
absl::StatusOr<std::vector<double>> ReadAttribute(const Source& source, const json& attributes, const char* name,
                                                  int components) {
  const auto it = attributes.find(name);
  if (it == attributes.end()) return std::vector<double>();
  BAKEWELL_ASSIGN_OR_RETURN(std::vector<double> values, ReadNumbers(source, it->get<int>(), components));
  for (const double value : values) {
    if (!std::isfinite(value)) return absl::InvalidArgumentError(absl::StrCat(name, " of an instance is not finite"));
  }
  return values;
}

json Slice(const std::vector<double>& values, size_t instance, size_t components) {
  const auto first = values.begin() + static_cast<std::ptrdiff_t>(instance * components);
  return std::vector<double>(first, first + static_cast<std::ptrdiff_t>(components));
}

struct Attribute {
  const char* gpu_name;
  const char* node_name;
  int components;
};
constexpr Attribute kAttributes[] = {
    {"TRANSLATION", "translation", 3}, {"ROTATION", "rotation", 4}, {"SCALE", "scale", 3}};

absl::Status CheckCount(const Source& source, const json& attributes, uint64_t max_instances) {
  uint64_t count = 0;
  for (const Attribute& attribute : kAttributes) {
    const auto it = attributes.find(attribute.gpu_name);
    if (it == attributes.end()) continue;
    const uint64_t has = source.model.accessors[it->get<size_t>()].count;
    if (count != 0 && has != count) return absl::InvalidArgumentError("its instance attributes differ in length");
    count = has;
  }
  if (count == 0) return absl::InvalidArgumentError("EXT_mesh_gpu_instancing has no TRANSLATION, ROTATION or SCALE");
  if (count > max_instances) {
    return absl::InvalidArgumentError(absl::StrCat(count, " instances, at most ", max_instances, " are read"));
  }
  return absl::OkStatus();
}

absl::StatusOr<Instances> FromAttributes(const Source& source, const json& attributes, uint64_t max_instances) {
  BAKEWELL_RETURN_IF_ERROR(CheckCount(source, attributes, max_instances));
  Instances instances;
  instances.present = true;
  for (const auto& [gpu_name, node_name, components] : kAttributes) {
    BAKEWELL_ASSIGN_OR_RETURN(const auto values, ReadAttribute(source, attributes, gpu_name, components));
    const auto width = static_cast<size_t>(components);
    if (!values.empty()) instances.trs.resize(values.size() / width, json::object());
    for (size_t i = 0; i < values.size() / width; ++i) instances.trs[i][node_name] = Slice(values, i, width);
  }
  for (const json& trs : instances.trs) {
    BAKEWELL_ASSIGN_OR_RETURN(const Transform transform, LocalTransform(trs));
    instances.node_from_instance.push_back(transform);
  }
  return instances;
}

}  // namespace

int DefaultScene(const Source& source) {
  if (source.model.defaultScene >= 0) return source.model.defaultScene;
  return source.model.scenes.empty() ? -1 : 0;
}

absl::StatusOr<std::vector<PlacedNode>> PlaceNodes(const Source& source) {
  std::vector<PlacedNode> placed;
  const int scene = DefaultScene(source);
  if (scene < 0) return placed;
  struct Pending {
    int node;
    Transform world_from_parent;
  };
  // A stack, so that depth costs no recursion; children are pushed last to first to keep the file's order.
  std::vector<Pending> pending;
  const auto push = [&](const std::vector<int>& nodes, const Transform& world_from_parent) {
    for (auto it = nodes.rbegin(); it != nodes.rend(); ++it) pending.push_back({*it, world_from_parent});
  };
  push(source.model.scenes[static_cast<size_t>(scene)].nodes, Transform{});
  std::vector<bool> visited(source.model.nodes.size());
  while (!pending.empty()) {
    const Pending next = pending.back();
    pending.pop_back();
    const auto index = static_cast<size_t>(next.node);
    if (visited[index]) return ErrorAt(source, next.node, "is reached twice: a cycle or a shared child");
    visited[index] = true;
    BAKEWELL_ASSIGN_OR_RETURN(const Transform world, WorldTransform(source, next.node, next.world_from_parent));
    placed.push_back({next.node, world});
    push(source.model.nodes[index].children, world);
  }
  return placed;
}

absl::StatusOr<Instances> ReadInstances(const Source& source, int node, uint64_t max_instances) {
  const json* attributes = Find(NodeJson(source, node), {"extensions", "EXT_mesh_gpu_instancing", "attributes"});
  if (!attributes) return Instances{};
  auto instances = FromAttributes(source, *attributes, max_instances);
  if (!instances.ok()) return ErrorAt(source, node, instances.status().message());
  return instances;
}

}  // namespace bakewell::gltf
