#pragma once

#include <string>

#include "core/scene/scene.h"

namespace bakewell {

// A rectangle of a lightmap page in texels, x right, y down. Empty: no TEXCOORD_1.
struct PageRect {
  float x = 0, y = 0, width = 0, height = 0;
};

// What a shape is made of and where its charts lie.
struct Surface {
  int material = 0;
  bool lightmapped = true;
  PageRect page{};
  std::string name{};
};

// Builds a Scene for a test from shapes given in world metres, without a file. Each call of an Add function for a shape
// adds one Object; they are in the order of the calls until Canonicalize. Material 0 exists and is grey, albedo 0.5.
class SceneBuilder {
 public:
  // `page` is the size of the page that every PageRect lies on.
  explicit SceneBuilder(PageHint page = {64, 64});

  // Their indices.
  int AddMaterial(Rgb albedo, Rgb emission = {0, 0, 0});
  int AddMaterial(Material material);
  int AddTexture(Texture texture);

  // The parallelogram origin + s edge_u + t edge_v, s and t in [0,1]; its front is cross(edge_u, edge_v). s runs along
  // x of the page rectangle, t along y, and the rectangle is covered exactly. TEXCOORD_0 is (s, t).
  int AddQuad(Vec3d origin_ws, Vec3d edge_u, Vec3d edge_v, const Surface& surface = {});
  int AddTriangle(Vec3d a_ws, Vec3d b_ws, Vec3d c_ws, const Surface& surface = {});
  // A closed axis-aligned box whose faces look outwards; the page rectangle is cut into 3 x 2 cells, faces +X -X +Y in
  // the upper row, -Y +Z -Z in the lower one.
  int AddBox(Vec3d min_ws, Vec3d max_ws, const Surface& surface = {});
  // As AddBox, faces looking inwards.
  int AddRoom(Vec3d min_ws, Vec3d max_ws, const Surface& surface = {});
  // A latitude-longitude sphere of 2 n x n quads with smooth normals; the page rectangle is longitude x latitude.
  int AddSphere(Vec3d center_ws, double radius_m, int n, const Surface& surface = {});

  void AddPointLight(Vec3d position_ws, Rgb intensity);
  // Half-angles of the cone.
  void AddSpotLight(Vec3d position_ws, Vec3d direction_ws, Rgb intensity, double inner_rad, double outer_rad);
  void AddDirectionalLight(Vec3d direction_ws, Rgb irradiance, double angular_diameter_rad = 0);
  void SetEnvironment(const Environment& environment);
  void SetConstantSky(Rgb radiance);

  // The scene in the order of the calls, or canonical; its origin is the mean of all vertices, as the loader has it.
  Scene Build() const;
  Scene BuildCanonical() const;

 private:
  struct Mesh;
  int AddMesh(const Mesh& mesh, const Surface& surface);
  void AppendQuad(Mesh& mesh, Vec3d origin_ws, Vec3d edge_u, Vec3d edge_v, PageRect rect) const;
  Mesh BoxMesh(Vec3d min_ws, Vec3d max_ws, PageRect rect, double side) const;
  Vec2f PageUv(PageRect rect, double s, double t) const;

  PageHint page_;
  Scene scene_;                                // positions are empty until Build
  std::vector<std::vector<Vec3d>> positions_;  // per object, world
  std::vector<Vec3d> light_positions_;         // per light, world
};

}  // namespace bakewell
