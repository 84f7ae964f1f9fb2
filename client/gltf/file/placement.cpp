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

struct AttributeName {
  const char* gpu_name;
  const char* node_name;
  int components;
};
constexpr AttributeName kAttributes[] = {
    {"TRANSLATION", "translation", 3}, {"ROTATION", "rotation", 4}, {"SCALE", "scale", 3}};

const json* InstancingOf(const Source& source, int node) {
  return Find(NodeJson(source, node), {"extensions", "EXT_mesh_gpu_instancing", "attributes"});
}

// The length of the first attribute that is there; 0 where none is.
uint64_t CountOf(const Source& source, const json& attributes) {
  for (const AttributeName& attribute : kAttributes) {
    const auto it = attributes.find(attribute.gpu_name);
    if (it != attributes.end()) return source.model.accessors[it->get<size_t>()].count;
  }
  return 0;
}

absl::StatusOr<Instances> FromAttributes(const Source& source, const json& attributes) {
  Instances instances;
  instances.present = true;
  const uint64_t count = CountOf(source, attributes);
  if (count == 0) return absl::InvalidArgumentError("EXT_mesh_gpu_instancing has no TRANSLATION, ROTATION or SCALE");
  for (const auto& [gpu_name, node_name, components] : kAttributes) {
    BAKEWELL_ASSIGN_OR_RETURN(std::vector<double> values, ReadAttribute(source, attributes, gpu_name, components));
    const auto width = static_cast<size_t>(components);
    if (values.empty()) continue;
    if (values.size() != count * width) return absl::InvalidArgumentError("its instance attributes differ in length");
    instances.attributes.push_back({node_name, width, std::move(values)});
  }
  for (size_t i = 0; i < count; ++i) {
    BAKEWELL_ASSIGN_OR_RETURN(const Transform transform, LocalTransform(NodeOfInstance(instances, i)));
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

uint64_t InstanceCount(const Source& source, int node) {
  const json* attributes = InstancingOf(source, node);
  return attributes ? CountOf(source, *attributes) : 1;
}

absl::StatusOr<Instances> ReadInstances(const Source& source, int node) {
  const json* attributes = InstancingOf(source, node);
  if (!attributes) return Instances{};
  auto instances = FromAttributes(source, *attributes);
  if (!instances.ok()) return ErrorAt(source, node, instances.status().message());
  return instances;
}

json NodeOfInstance(const Instances& instances, size_t instance) {
  json node = json::object();
  for (const Instances::Attribute& attribute : instances.attributes) {
    const auto first = attribute.values.begin() + static_cast<std::ptrdiff_t>(instance * attribute.width);
    node[attribute.name] = std::vector<double>(first, first + static_cast<std::ptrdiff_t>(attribute.width));
  }
  return node;
}

}  // namespace bakewell::gltf
