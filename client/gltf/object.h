#pragma once

#include <vector>

#include "client/gltf/file/transform.h"
#include "client/gltf/level.h"
#include "client/gltf/primitive.h"
#include "core/scene/mean_point.h"

namespace bakewell::gltf {

// An object on its way: in world space, double precision, not yet relative to the scene's origin.
struct WorldObject {
  Object object;                   // all but position and normal; index still has the bad triangles
  std::vector<Vec3d> position_ws;  // V
  std::vector<Vec3d> normal_ws;    // V, not normalised, or empty: flat normals are wanted
  std::vector<bool> bad_triangle;  // T, those with a corner that is not finite or too far
  std::vector<bool> live_vertex;   // V, those of the other triangles
  ObjectReport report;
};

// Places a primitive: positions and normals to the world, winding turned where the transform mirrors, vertices unshared
// where normals are missing.
WorldObject PlaceObject(const PrimitiveData& data, const Transform& world_from_mesh);

// Adds the live vertices.
void AddTo(MeanPoint& mean, const WorldObject& object);

// Fills in position and normal relative to `origin_ws`, collapses bad, degenerate and duplicate triangles to {a, a, a},
// and counts them in the report. Vertices of bad triangles alone lie in the origin.
void FinishObject(WorldObject& object, Vec3d origin_ws);

}  // namespace bakewell::gltf
