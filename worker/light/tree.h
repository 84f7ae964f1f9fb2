#pragma once

#include <span>
#include <vector>

#include "worker/light/lights.h"
#include "worker/light/pack.h"

namespace bakewell {

// A binary tree over the local lights, to choose one of them for a point in a time that grows with the logarithm of
// their number (Conty Estevez & Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting"). A leaf
// is one light. A node knows its lights' bounding sphere, intensity, and a cone that holds the directions they emit to.
class LightTree {
 public:
  explicit LightTree(const LightSet& lights);

  bool empty() const { return nodes_.empty(); }
  static constexpr int kRoot = 0;

  // About the unoccluded irradiance (luminance) that a node brings to a place, exactly 0 only where it brings none.
  float Importance(int node, const LitPlace& place) const;

  struct Pick {
    int light = -1;         // -1: none of the node's lights reaches the place
    float probability = 0;  // of the light, given the node
  };
  // One light of a node; u in [0, 1). Down to LightPack::kMost lights it chooses between halves, then among them all: a
  // half whose lights are near and far, in front and behind is badly told by its sphere and its cone.
  Pick Draw(int node, const LitPlace& place, float u) const;
  // With which probability Draw gives a light of the node.
  float Probability(int node, int light, const LitPlace& place) const;

  // Nodes that hold every light once, at most `most` of them, split where their light at the place is strongest; by the
  // first light that they hold.
  std::vector<int> Cut(const LitPlace& place, size_t most) const;
  // At least the unoccluded irradiance (luminance) that a node's lights bring together to any point of a place,
  // whichever way it faces: intensity over the square of the least distance, nothing from behind their cones.
  float Bound(int node, const LitPlace& place) const;
  // The nodes of `cut` without the weakest, whose bounds together stay within `dispensable`.
  std::vector<int> Cull(std::span<const int> cut, const LitPlace& place, float dispensable) const;
  // All lights of a node.
  std::span<const int> LightsOf(int node) const;
  const LightShape& ShapeOf(int node) const { return nodes_[static_cast<size_t>(node)].shape; }
  bool IsLeaf(int node) const { return nodes_[static_cast<size_t>(node)].left < 0; }

 private:
  struct Node {
    LightShape shape;  // that holds its lights
    int left = -1, right = -1;
    int begin = 0, end = 0;  // lights_[begin, end)
  };
  int Build(int begin, int end);
  LightShape Enclose(const Node& node) const;
  static size_t CountOf(const Node& node) { return static_cast<size_t>(node.end - node.begin); }

  const LightSet& set_;
  std::vector<int> lights_;          // light numbers, so that every node's are consecutive
  std::vector<int> place_of_light_;  // in lights_
  LightPack pack_, node_pack_;       // of lights_, of nodes_
  std::vector<Node> nodes_;
};

}  // namespace bakewell
