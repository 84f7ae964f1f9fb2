#include <algorithm>
#include <cmath>
#include <string_view>

#include <absl/strings/str_cat.h>

#include "core/scene/canonical.h"
#include "core/scene/content.h"

namespace bakewell {
namespace {

constexpr std::string_view kMagic = "BWSC";
constexpr uint32_t kVersion = 1;
// The least bytes that one of each takes, from schema/scene.md: what bounds a hostile count.
constexpr size_t kTextureBytes = 19, kMaterialBytes = 90, kLightBytes = 61, kObjectBytes = 49;

bool AllFinite(std::span<const float> values) {
  return std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); });
}

template <typename T>
bool AllFinite(const std::vector<T>& values) {
  return AllFinite(std::span(reinterpret_cast<const float*>(values.data()), values.size() * sizeof(T) / sizeof(float)));
}

// A finite float value or vector.
template <typename T>
T GetFinite(ByteReader& reader) {
  const std::vector<T> value{reader.Get<T>()};
  if (!AllFinite(value)) reader.Fail("a number is not finite");
  return value[0];
}

template <typename T>
std::vector<T> GetFiniteVector(ByteReader& reader) {
  std::vector<T> values = reader.GetVector<T>();
  if (!AllFinite(values)) reader.Fail("a number is not finite");
  return values;
}

// Light of a lamp, a surface or the sky.
Rgb GetRadiated(ByteReader& reader) {
  const Rgb light = GetFinite<Rgb>(reader);
  if (!IsRadiated(light)) reader.Fail(absl::StrCat("a light is negative or above ", kMostRadiated));
  return light;
}

template <typename E>
E GetEnum(ByteReader& reader, E last) {
  const auto value = reader.Get<uint8_t>();
  if (value > static_cast<uint8_t>(last)) reader.Fail(absl::StrCat("enumerator ", value, " is unknown"));
  return value > static_cast<uint8_t>(last) ? last : static_cast<E>(value);
}

bool GetBool(ByteReader& reader) {
  const auto value = reader.Get<uint8_t>();
  if (value > 1) reader.Fail(absl::StrCat("flag ", value, " is neither 0 nor 1"));
  return value == 1;
}

// An index in [first, end).
int GetIndex(ByteReader& reader, int first, size_t end) {
  const auto value = reader.Get<int32_t>();
  const bool inside = value >= first && value < static_cast<int64_t>(end);
  if (!inside) reader.Fail(absl::StrCat("index ", value, " is outside of [", first, ", ", end, ")"));
  return inside ? value : first;
}

// Sizes with a product that a vector of that many pixels proves.
void RequirePixels(ByteReader& reader, int64_t width, int64_t height, size_t pixels) {
  const bool fits = width >= 0 && height >= 0 && width * height == static_cast<int64_t>(pixels);
  if (!fits) reader.Fail(absl::StrCat(width, " x ", height, " pixels are announced, ", pixels, " are there"));
}

TextureRef GetTextureRef(ByteReader& reader, size_t textures) {
  TextureRef ref;
  ref.texture = GetIndex(reader, -1, textures);
  ref.texcoord = GetIndex(reader, 0, 2);
  ref.offset = GetFinite<Vec2f>(reader);
  ref.scale = GetFinite<Vec2f>(reader);
  ref.rotation_rad = GetFinite<float>(reader);
  return ref;
}

Environment GetEnvironment(ByteReader& reader) {
  Environment environment;
  environment.type = GetEnum(reader, EnvironmentType::kLatLong);
  for (Rgb* radiance : {&environment.radiance, &environment.zenith, &environment.horizon, &environment.ground}) {
    *radiance = GetRadiated(reader);
  }
  environment.width = reader.Get<int32_t>();
  environment.height = reader.Get<int32_t>();
  environment.latlong = GetFiniteVector<Rgb>(reader);
  RequirePixels(reader, environment.width, environment.height, environment.latlong.size());
  if (!std::all_of(environment.latlong.begin(), environment.latlong.end(), IsRadiated)) {
    reader.Fail(absl::StrCat("a pixel of the environment is negative or above ", kMostRadiated));
  }
  if (environment.type == EnvironmentType::kLatLong && environment.latlong.empty()) {
    reader.Fail("a latitude-longitude environment has no pixels");
  }
  return environment;
}

std::optional<PageHint> GetPage(ByteReader& reader) {
  const PageHint page{reader.Get<int32_t>(), reader.Get<int32_t>()};
  if (page.width == 0 && page.height == 0) return std::nullopt;
  if (page.width <= 0 || page.height <= 0) {
    reader.Fail(absl::StrCat("a page of ", page.width, " x ", page.height, " texels"));
  }
  return page;
}

Texture GetTexture(ByteReader& reader) {
  Texture texture;
  texture.width = reader.Get<int32_t>();
  texture.height = reader.Get<int32_t>();
  texture.wrap_u = GetEnum(reader, WrapMode::kMirroredRepeat);
  texture.wrap_v = GetEnum(reader, WrapMode::kMirroredRepeat);
  texture.nearest = GetBool(reader);
  texture.rgba = reader.GetVector<uint8_t>();
  RequirePixels(reader, texture.width, texture.height, texture.rgba.size() / 4);
  if (texture.rgba.empty() || texture.rgba.size() % 4 != 0) reader.Fail("a texture is not made of RGBA pixels");
  return texture;
}

Material GetMaterial(ByteReader& reader, size_t textures) {
  Material material;
  material.base_color = GetFinite<Rgb>(reader);
  material.base_alpha = GetFinite<float>(reader);
  material.base_texture = GetTextureRef(reader, textures);
  material.alpha_mode = GetEnum(reader, AlphaMode::kBlend);
  material.alpha_cutoff = GetFinite<float>(reader);
  material.emission = GetRadiated(reader);
  material.emission_texture = GetTextureRef(reader, textures);
  material.double_sided = GetBool(reader);
  return material;
}

PunctualLight GetLight(ByteReader& reader) {
  PunctualLight light;
  light.type = GetEnum(reader, LightType::kDirectional);
  light.intensity = GetRadiated(reader);
  for (Vec3f* value : {&light.position, &light.direction, &light.tangent}) {
    *value = GetFinite<Vec3f>(reader);
  }
  for (float* value : {&light.cos_inner, &light.cos_outer, &light.angular_diameter_rad}) {
    *value = GetFinite<float>(reader);
  }
  return light;
}

void RequireTriangles(ByteReader& reader, const Object& object) {
  const size_t vertices = object.position.size();
  const bool whole = object.normal.size() == vertices && object.uv0.size() == vertices &&
                     (object.uv1.empty() || object.uv1.size() == vertices) && object.index.size() % 3 == 0;
  if (!whole) reader.Fail(absl::StrCat("the attributes of an object of ", vertices, " vertices differ in length"));
  const bool inside = std::all_of(object.index.begin(), object.index.end(), [&](uint32_t i) { return i < vertices; });
  if (!inside) reader.Fail(absl::StrCat("an index is beyond the object's ", vertices, " vertices"));
}

Object GetObject(ByteReader& reader, size_t materials) {
  Object object;
  object.material = GetIndex(reader, 0, materials);
  object.lightmapped = GetBool(reader);
  object.density = GetFinite<float>(reader);
  object.position = GetFiniteVector<Vec3f>(reader);
  object.normal = GetFiniteVector<Vec3f>(reader);
  object.uv0 = GetFiniteVector<Vec2f>(reader);
  object.uv1 = GetFiniteVector<Vec2f>(reader);
  object.index = reader.GetVector<uint32_t>();
  RequireTriangles(reader, object);
  return object;
}

void GetHeader(ByteReader& reader) {
  for (const char expected : kMagic) {
    if (reader.Get<char>() != expected) reader.Fail("these are not the bytes of a scene (BWSC)");
  }
}

// `get` reads one element; `min_bytes` is the least that one takes.
template <typename T, typename Get>
std::vector<T> GetAll(ByteReader& reader, size_t min_bytes, Get get) {
  std::vector<T> all(reader.GetCount(min_bytes));
  for (T& one : all) {
    if (!reader.ok()) break;
    one = get();
  }
  return all;
}

Scene GetContent(ByteReader& reader) {
  Scene scene;
  for (int axis = 0; axis < 3; ++axis) scene.origin_ws[axis] = reader.Get<double>();
  if (!IsFinite(scene.origin_ws)) reader.Fail("the origin is not finite");
  scene.environment = GetEnvironment(reader);
  scene.lightmap_page = GetPage(reader);
  scene.textures = GetAll<Texture>(reader, kTextureBytes, [&] { return GetTexture(reader); });
  scene.materials =
      GetAll<Material>(reader, kMaterialBytes, [&] { return GetMaterial(reader, scene.textures.size()); });
  scene.lights = GetAll<PunctualLight>(reader, kLightBytes, [&] { return GetLight(reader); });
  scene.objects = GetAll<Object>(reader, kObjectBytes, [&] { return GetObject(reader, scene.materials.size()); });
  return scene;
}

void GetNames(ByteReader& reader, Scene& scene) {
  for (Object& object : scene.objects) {
    object.name = reader.GetString();
    ObjectSource& s = object.source;
    for (int* id : {&s.node, &s.mesh, &s.primitive, &s.instance}) *id = reader.Get<int32_t>();
  }
  for (Material& material : scene.materials) material.name = reader.GetString();
  for (PunctualLight& light : scene.lights) light.name = reader.GetString();
  if (!reader.AtEnd()) reader.Fail("bytes follow the scene");
}

}  // namespace

absl::StatusOr<Scene> ParseScene(std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  GetHeader(reader);
  const auto version = reader.Get<uint32_t>();
  BAKEWELL_RETURN_IF_ERROR(reader.status());
  if (version != kVersion) {
    return absl::FailedPreconditionError(
        absl::StrCat("the scene has format version ", version, ", this program reads ", kVersion));
  }
  Scene scene = GetContent(reader);
  GetNames(reader, scene);
  BAKEWELL_RETURN_IF_ERROR(reader.status());
  return scene;
}

}  // namespace bakewell
