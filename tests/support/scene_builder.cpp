#include "tests/support/scene_builder.h"

#include <cmath>

#include "core/scene/canonical.h"
#include "core/scene/mean_point.h"

namespace bakewell {

struct SceneBuilder::Mesh {
  std::vector<Vec3d> position;
  std::vector<Vec3f> normal;
  std::vector<Vec2f> uv0, uv1;
  std::vector<uint32_t> index;
};

SceneBuilder::SceneBuilder(PageHint page) : page_(page) {
  scene_.lightmap_page = page;
  AddMaterial({0.5f, 0.5f, 0.5f});
}

int SceneBuilder::AddMaterial(Rgb albedo, Rgb emission) {
  Material material;
  material.base_color = albedo;
  material.emission = emission;
  return AddMaterial(material);
}

int SceneBuilder::AddMaterial(Material material) {
  scene_.materials.push_back(std::move(material));
  return static_cast<int>(scene_.materials.size()) - 1;
}

int SceneBuilder::AddTexture(Texture texture) {
  scene_.textures.push_back(std::move(texture));
  return static_cast<int>(scene_.textures.size()) - 1;
}

Vec2f SceneBuilder::PageUv(PageRect rect, double s, double t) const {
  return {static_cast<float>((rect.x + s * rect.width) / page_.width),
          static_cast<float>((rect.y + t * rect.height) / page_.height)};
}

int SceneBuilder::AddMesh(const Mesh& mesh, const Surface& surface) {
  Object object;
  object.name = surface.name;
  object.material = surface.material;
  object.lightmapped = surface.lightmapped;
  object.normal = mesh.normal;
  object.uv0 = mesh.uv0;
  if (surface.page.width > 0) object.uv1 = mesh.uv1;
  object.index = mesh.index;
  object.source.node = object.source.mesh = static_cast<int>(scene_.objects.size());
  object.source.primitive = 0;
  scene_.objects.push_back(std::move(object));
  positions_.push_back(mesh.position);
  return static_cast<int>(scene_.objects.size()) - 1;
}

void SceneBuilder::AppendQuad(Mesh& mesh, Vec3d origin_ws, Vec3d edge_u, Vec3d edge_v, PageRect rect) const {
  const auto first = static_cast<uint32_t>(mesh.position.size());
  const Vec3f normal = ToFloat(NormalizeOrZero(Cross(edge_u, edge_v)));
  for (const Vec2d st : {Vec2d{0, 0}, Vec2d{1, 0}, Vec2d{1, 1}, Vec2d{0, 1}}) {
    mesh.position.push_back(origin_ws + edge_u * st.x + edge_v * st.y);
    mesh.normal.push_back(normal);
    mesh.uv0.push_back({static_cast<float>(st.x), static_cast<float>(st.y)});
    mesh.uv1.push_back(PageUv(rect, st.x, st.y));
  }
  for (const uint32_t corner : {0u, 1u, 2u, 0u, 2u, 3u}) mesh.index.push_back(first + corner);
}

int SceneBuilder::AddQuad(Vec3d origin_ws, Vec3d edge_u, Vec3d edge_v, const Surface& surface) {
  Mesh mesh;
  AppendQuad(mesh, origin_ws, edge_u, edge_v, surface.page);
  return AddMesh(mesh, surface);
}

int SceneBuilder::AddTriangle(Vec3d a_ws, Vec3d b_ws, Vec3d c_ws, const Surface& surface) {
  Mesh mesh;
  AppendQuad(mesh, a_ws, b_ws - a_ws, c_ws - a_ws, surface.page);
  // Corner 3 of the quad is c; corner 2 is not wanted.
  mesh.position[2] = mesh.position[3];
  mesh.uv0[2] = mesh.uv0[3];
  mesh.uv1[2] = mesh.uv1[3];
  mesh.index = {0, 1, 2};
  mesh.position.pop_back();
  mesh.normal.pop_back();
  mesh.uv0.pop_back();
  mesh.uv1.pop_back();
  return AddMesh(mesh, surface);
}

SceneBuilder::Mesh SceneBuilder::BoxMesh(Vec3d min_ws, Vec3d max_ws, PageRect rect, double side) const {
  Mesh mesh;
  const Vec3d size = max_ws - min_ws;
  for (int face = 0; face < 6; ++face) {
    const int axis = face / 2;
    const bool positive = face % 2 == 0;
    Vec3d u, v, origin = min_ws;
    u[(axis + 1) % 3] = size[(axis + 1) % 3];
    v[(axis + 2) % 3] = size[(axis + 2) % 3];
    if (positive) origin[axis] = max_ws[axis];
    // u x v is +axis: swap where the face shall look the other way.
    if (positive != (side > 0)) std::swap(u, v);
    const float w = rect.width / 3, h = rect.height / 2;
    const auto column = static_cast<float>(face % 3), row = static_cast<float>(face / 3);
    AppendQuad(mesh, origin, u, v, {rect.x + column * w, rect.y + row * h, w, h});
  }
  return mesh;
}

int SceneBuilder::AddBox(Vec3d min_ws, Vec3d max_ws, const Surface& surface) {
  return AddMesh(BoxMesh(min_ws, max_ws, surface.page, 1), surface);
}

int SceneBuilder::AddRoom(Vec3d min_ws, Vec3d max_ws, const Surface& surface) {
  return AddMesh(BoxMesh(min_ws, max_ws, surface.page, -1), surface);
}

int SceneBuilder::AddSphere(Vec3d center_ws, double radius_m, int n, const Surface& surface) {
  Mesh mesh;
  const int columns = 2 * n;
  for (int row = 0; row <= n; ++row) {
    for (int column = 0; column <= columns; ++column) {
      const double s = static_cast<double>(column) / columns, t = static_cast<double>(row) / n;
      const double ring = std::sin(kPi * t);
      const Vec3d normal{ring * std::cos(2 * kPi * s), std::cos(kPi * t), -ring * std::sin(2 * kPi * s)};
      mesh.position.push_back(center_ws + normal * radius_m);
      mesh.normal.push_back(ToFloat(normal));
      mesh.uv0.push_back({static_cast<float>(s), static_cast<float>(t)});
      mesh.uv1.push_back(PageUv(surface.page, s, t));
    }
  }
  // Two triangles a cell, but for the one that collapses at either pole.
  for (int row = 0; row < n; ++row) {
    for (int column = 0; column < columns; ++column) {
      const auto a = static_cast<uint32_t>(row * (columns + 1) + column), b = a + 1;
      const uint32_t c = a + static_cast<uint32_t>(columns) + 1, d = c + 1;
      if (row > 0) mesh.index.insert(mesh.index.end(), {a, c, b});
      if (row < n - 1) mesh.index.insert(mesh.index.end(), {b, c, d});
    }
  }
  return AddMesh(mesh, surface);
}

void SceneBuilder::AddPointLight(Vec3d position_ws, Rgb intensity) {
  PunctualLight light;
  light.intensity = intensity;
  scene_.lights.push_back(light);
  light_positions_.push_back(position_ws);
}

void SceneBuilder::AddSpotLight(Vec3d position_ws, Vec3d direction_ws, Rgb intensity, double inner_rad,
                                double outer_rad) {
  PunctualLight light;
  light.type = LightType::kSpot;
  light.intensity = intensity;
  light.direction = ToFloat(NormalizeOrZero(direction_ws));
  light.tangent = FrameFromNormal(light.direction).t;
  light.cos_inner = static_cast<float>(std::cos(inner_rad));
  light.cos_outer = static_cast<float>(std::cos(outer_rad));
  scene_.lights.push_back(light);
  light_positions_.push_back(position_ws);
}

void SceneBuilder::AddDirectionalLight(Vec3d direction_ws, Rgb irradiance, double angular_diameter_rad) {
  PunctualLight light;
  light.type = LightType::kDirectional;
  light.intensity = irradiance;
  light.direction = ToFloat(NormalizeOrZero(direction_ws));
  light.tangent = FrameFromNormal(light.direction).t;
  light.angular_diameter_rad = static_cast<float>(angular_diameter_rad);
  scene_.lights.push_back(light);
  light_positions_.push_back({});
}

void SceneBuilder::SetEnvironment(const Environment& environment) { scene_.environment = environment; }

void SceneBuilder::SetConstantSky(Rgb radiance) {
  scene_.environment = {};
  scene_.environment.type = EnvironmentType::kConstant;
  scene_.environment.radiance = radiance;
}

Scene SceneBuilder::Build() const {
  Scene scene = scene_;
  MeanPoint mean;
  for (const auto& positions : positions_) {
    for (const Vec3d& position : positions) mean.Add(position);
  }
  scene.origin_ws = mean.Value();
  for (size_t i = 0; i < positions_.size(); ++i) {
    for (const Vec3d& position : positions_[i]) {
      scene.objects[i].position.push_back(ToFloat(position - scene.origin_ws));
    }
  }
  for (size_t i = 0; i < scene.lights.size(); ++i) {
    const bool placed = scene.lights[i].type != LightType::kDirectional;
    if (placed) scene.lights[i].position = ToFloat(light_positions_[i] - scene.origin_ws);
  }
  return scene;
}

Scene SceneBuilder::BuildCanonical() const {
  Scene scene = Build();
  Canonicalize(scene);
  return scene;
}

}  // namespace bakewell
