#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/math/vec.h"

// The scene as every program sees it: flat (no node hierarchy, instances expanded), in the world frame of theory.md 1,
// metres, positions relative to Scene::origin_ws so that a level ten kilometres from zero keeps float precision.
namespace bakewell {

enum class WrapMode : uint8_t { kRepeat, kClampToEdge, kMirroredRepeat };
enum class AlphaMode : uint8_t { kOpaque, kMask, kBlend };

// 8 bits a channel, RGBA, row 0 is v = 0. Colour is sRGB-encoded and decoded at look-up; alpha is linear.
struct Texture {
  int width = 0, height = 0;
  WrapMode wrap_u = WrapMode::kRepeat, wrap_v = WrapMode::kRepeat;
  bool nearest = false;
  std::vector<uint8_t> rgba;  // 4 * width * height
};

// Which texture, which UV set, and KHR_texture_transform: uv' = offset + R(rotation) (scale * uv), where
// R(a) (u, v) = (u cos a + v sin a, -u sin a + v cos a): counter-clockwise on screen, as v points down. (The matrix in
// the extension's text turns the other way: KhronosGroup/glTF issue 1563; this is what Babylon.js and three.js
// do.)
struct TextureRef {
  int texture = -1;  // -1: none
  int texcoord = 0;  // 0 or 1
  Vec2f offset{0, 0}, scale{1, 1};
  float rotation_rad = 0;
};

struct Material {
  std::string name;
  Rgb base_color{1, 1, 1};  // diffuse albedo, linear, [0,1]
  float base_alpha = 1;
  TextureRef base_texture;
  AlphaMode alpha_mode = AlphaMode::kOpaque;
  float alpha_cutoff = 0.5f;
  Rgb emission{0, 0, 0};  // radiance of the front side [W m^-2 sr^-1]
  TextureRef emission_texture;
  bool double_sided = false;
};

// Where an object came from in the input file, to write TEXCOORD_1 back.
struct ObjectSource {
  int node = -1, mesh = -1, primitive = -1, instance = -1;
};

// One primitive of one node (or of one GPU instance), triangles only.
struct Object {
  std::string name;
  int material = 0;
  bool lightmapped = true;
  float density = 1;            // factor on the texel density of its charts (node.extras.lightmapDensity)
  std::vector<Vec3f> position;  // V, relative to Scene::origin_ws [m]
  std::vector<Vec3f> normal;    // V, unit, world frame
  std::vector<Vec2f> uv0;       // V
  std::vector<Vec2f> uv1;       // V, or empty where the input has no TEXCOORD_1
  std::vector<uint32_t> index;  // 3 T, counter-clockwise seen from the front
  ObjectSource source;
};

// The most that a lamp or a sun may bring [W/sr, W m^-2] and a surface or the sky radiate [W m^-2 sr^-1], per channel.
// Errors are squares, and floats end at 3.4e38: this leaves a factor of 10^3 for lamps that nearly touch what they
// light.
inline constexpr float kMostRadiated = 1e15f;

inline bool IsRadiated(Rgb light) {
  return IsFinite(light) && std::min({light.x, light.y, light.z}) >= 0 && MaxComponent(light) <= kMostRadiated;
}

enum class LightType : uint8_t { kPoint, kSpot, kDirectional };

// KHR_lights_punctual, radiometric 1:1 (theory.md 1).
struct PunctualLight {
  std::string name;
  LightType type = LightType::kPoint;
  // Point, spot: radiant intensity I [W/sr]. Directional: irradiance on a perpendicular plane [W m^-2].
  Rgb intensity{0, 0, 0};
  Vec3f position;                      // relative to Scene::origin_ws [m]
  Vec3f direction{0, 0, -1};           // unit, the way light travels (the node's -Z)
  Vec3f tangent{1, 0, 0};              // unit, perpendicular to direction: samples turn with the node
  float cos_inner = 1, cos_outer = 0;  // spot
  float angular_diameter_rad = 0;      // directional; 0 is a delta
};

enum class EnvironmentType : uint8_t { kNone, kConstant, kGradient, kLatLong };

// L(d), d unit. Gradient: ground for d.y < 0, else horizon + (zenith - horizon) d.y.
// LatLong: row 0 is +Y, column 0 begins at azimuth 0 = +X towards +Z; u = atan2(z, x) / 2pi mod 1, v = acos(y) / pi.
struct Environment {
  EnvironmentType type = EnvironmentType::kNone;
  Rgb radiance{0, 0, 0};                                   // constant [W m^-2 sr^-1]
  Rgb zenith{0, 0, 0}, horizon{0, 0, 0}, ground{0, 0, 0};  // gradient
  int width = 0, height = 0;
  std::vector<Rgb> latlong;  // width * height radiances
};

struct PageHint {
  int width = 0, height = 0;
};

struct Scene {
  Vec3d origin_ws{0, 0, 0};
  std::vector<Object> objects;
  std::vector<Material> materials;
  std::vector<Texture> textures;
  std::vector<PunctualLight> lights;
  Environment environment;
  std::optional<PageHint> lightmap_page;  // scene.extras.lightmap {width, height}: the page TEXCOORD_1 was made for
};

}  // namespace bakewell
