#pragma once

#include <vector>

#include "client/gltf/file/accessor.h"
#include "client/gltf/file/transform.h"

namespace bakewell::gltf {

// A node of the scene that is baked.
struct PlacedNode {
  int node = 0;
  Transform world_from_node;
};

// The scene that is baked: `scene`, else 0; -1 where the file has none.
int DefaultScene(const Source& source);

// The nodes of the default scene, parents before children. kInvalidArgument for a node that is reached twice (a cycle
// or a shared child) and for transforms that are not affine or overflow, naming the node.
absl::StatusOr<std::vector<PlacedNode>> PlaceNodes(const Source& source);

// EXT_mesh_gpu_instancing of a node.
struct Instances {
  bool present = false;
  std::vector<nlohmann::json> trs;  // per instance, the members of a node that has its transform
  std::vector<Transform> node_from_instance;
};

// kInvalidArgument for attributes of different length or type, and for more than `max_instances`.
absl::StatusOr<Instances> ReadInstances(const Source& source, int node, uint64_t max_instances);

}  // namespace bakewell::gltf
