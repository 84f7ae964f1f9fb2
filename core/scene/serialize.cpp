#include "core/scene/canonical.h"
#include "core/scene/content.h"

namespace bakewell {
namespace {

constexpr char kMagic[4] = {'B', 'W', 'S', 'C'};
constexpr uint32_t kVersion = 1;

void PutTextureRef(ByteWriter& writer, const TextureRef& ref) {
  writer.Put(static_cast<int32_t>(ref.texture));
  writer.Put(static_cast<int32_t>(ref.texcoord));
  writer.Put(ref.offset);
  writer.Put(ref.scale);
  writer.Put(ref.rotation_rad);
}

void PutEnvironment(ByteWriter& writer, const Environment& environment) {
  writer.Put(static_cast<uint8_t>(environment.type));
  for (const Rgb& radiance : {environment.radiance, environment.zenith, environment.horizon, environment.ground}) {
    writer.Put(radiance);
  }
  writer.Put(static_cast<int32_t>(environment.width));
  writer.Put(static_cast<int32_t>(environment.height));
  writer.PutVector(environment.latlong);
}

void PutPage(ByteWriter& writer, const std::optional<PageHint>& page) {
  writer.Put(static_cast<int32_t>(page ? page->width : 0));
  writer.Put(static_cast<int32_t>(page ? page->height : 0));
}

void PutNames(ByteWriter& writer, const Scene& scene) {
  for (const Object& object : scene.objects) {
    writer.PutString(object.name);
    const ObjectSource& s = object.source;
    for (const int id : {s.node, s.mesh, s.primitive, s.instance}) writer.Put(static_cast<int32_t>(id));
  }
  for (const Material& material : scene.materials) writer.PutString(material.name);
  for (const PunctualLight& light : scene.lights) writer.PutString(light.name);
}

}  // namespace

void PutTexture(ByteWriter& writer, const Texture& texture) {
  writer.Put(static_cast<int32_t>(texture.width));
  writer.Put(static_cast<int32_t>(texture.height));
  writer.Put(static_cast<uint8_t>(texture.wrap_u));
  writer.Put(static_cast<uint8_t>(texture.wrap_v));
  writer.Put(static_cast<uint8_t>(texture.nearest ? 1 : 0));
  writer.PutVector(texture.rgba);
}

void PutMaterial(ByteWriter& writer, const Material& material) {
  writer.Put(material.base_color);
  writer.Put(material.base_alpha);
  PutTextureRef(writer, material.base_texture);
  writer.Put(static_cast<uint8_t>(material.alpha_mode));
  writer.Put(material.alpha_cutoff);
  writer.Put(material.emission);
  PutTextureRef(writer, material.emission_texture);
  writer.Put(static_cast<uint8_t>(material.double_sided ? 1 : 0));
}

void PutGeometry(ByteWriter& writer, const Object& object) {
  writer.Put(static_cast<uint8_t>(object.lightmapped ? 1 : 0));
  writer.Put(object.density);
  writer.PutVector(object.position);
  writer.PutVector(object.normal);
  writer.PutVector(object.uv0);
  writer.PutVector(object.uv1);
  writer.PutVector(object.index);
}

void PutLight(ByteWriter& writer, const PunctualLight& light) {
  writer.Put(static_cast<uint8_t>(light.type));
  for (const Vec3f& value : {light.intensity, light.position, light.direction, light.tangent}) writer.Put(value);
  for (const float value : {light.cos_inner, light.cos_outer, light.angular_diameter_rad}) writer.Put(value);
}

void PutContent(ByteWriter& writer, const Scene& scene) {
  writer.Put(kMagic);
  writer.Put(kVersion);
  writer.Put(scene.origin_ws);
  PutEnvironment(writer, scene.environment);
  PutPage(writer, scene.lightmap_page);
  writer.Put(static_cast<uint64_t>(scene.textures.size()));
  for (const Texture& texture : scene.textures) PutTexture(writer, texture);
  writer.Put(static_cast<uint64_t>(scene.materials.size()));
  for (const Material& material : scene.materials) PutMaterial(writer, material);
  writer.Put(static_cast<uint64_t>(scene.lights.size()));
  for (const PunctualLight& light : scene.lights) PutLight(writer, light);
  writer.Put(static_cast<uint64_t>(scene.objects.size()));
  for (const Object& object : scene.objects) {
    writer.Put(static_cast<int32_t>(object.material));
    PutGeometry(writer, object);
  }
}

std::vector<std::byte> SerializeScene(const Scene& scene) {
  ByteWriter writer;
  PutContent(writer, scene);
  PutNames(writer, scene);
  return writer.Take();
}

Digest SceneDigest(const Scene& scene) {
  ByteWriter writer;
  PutContent(writer, scene);
  return Sha256Of(writer.bytes());
}

}  // namespace bakewell
