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
  // One of translation, rotation, scale: `width` numbers per instance.
  struct Attribute {
    const char* name = "";
    size_t width = 0;
    std::vector<double> values;
  };
  bool present = false;
  std::vector<Attribute> attributes;
  std::vector<Transform> node_from_instance;
};

// How often a node's mesh is there: 1 without the extension. Reads no accessor.
uint64_t InstanceCount(const Source& source, int node);

// kInvalidArgument for attributes of different length or type, or that are not finite.
absl::StatusOr<Instances> ReadInstances(const Source& source, int node);

// The members (translation, rotation, scale) of a node that is where an instance is.
nlohmann::json NodeOfInstance(const Instances& instances, size_t instance);

}  // namespace bakewell::gltf
