#include "core/scene/canonical.h"

#include <algorithm>
#include <map>
#include <numeric>

#include "core/base/check.h"
#include "core/scene/content.h"

namespace bakewell {
namespace {

// The digest of what `put` writes.
template <typename Put>
Digest DigestOf(Put put) {
  ByteWriter writer;
  put(writer);
  return Sha256Of(writer.bytes());
}

template <typename T, typename Of>
std::vector<Digest> DigestsOf(const std::vector<T>& all, Of of) {
  std::vector<Digest> digests;
  digests.reserve(all.size());
  for (const T& one : all) digests.push_back(of(one));
  return digests;
}

template <typename T>
void SortByDigest(std::vector<T>& all, const std::vector<Digest>& digests) {
  std::vector<size_t> order(all.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return digests[a] < digests[b]; });
  std::vector<T> sorted;
  sorted.reserve(all.size());
  for (const size_t i : order) sorted.push_back(std::move(all[i]));
  all = std::move(sorted);
}

// Numbers things by first use; equal content gets one number.
template <typename T>
class FirstUse {
 public:
  FirstUse(std::vector<T>& all, const std::vector<Digest>& digests) : all_(all), digests_(digests) {}
  int NumberOf(int old_index) {
    BAKEWELL_CHECK_OP(static_cast<size_t>(old_index), <, all_.size());
    const auto [it, added] = numbers_.try_emplace(digests_[old_index], static_cast<int>(used_.size()));
    if (added) used_.push_back(std::move(all_[old_index]));
    return it->second;
  }
  void Finish() { all_ = std::move(used_); }

 private:
  std::vector<T>& all_;
  const std::vector<Digest>& digests_;
  std::map<Digest, int> numbers_;
  std::vector<T> used_;
};

Digest MaterialDigest(Material material, const std::vector<Digest>& texture_digests) {
  return DigestOf([&](ByteWriter& writer) {
    for (TextureRef* ref : {&material.base_texture, &material.emission_texture}) {
      writer.Put(ref->texture < 0 ? Digest{}.bytes : texture_digests[ref->texture].bytes);
      ref->texture = -1;
    }
    PutMaterial(writer, material);
  });
}

void RenumberMaterials(Scene& scene, const std::vector<Digest>& digests) {
  FirstUse<Material> first_use(scene.materials, digests);
  for (Object& object : scene.objects) object.material = first_use.NumberOf(object.material);
  first_use.Finish();
}

void RenumberTextures(Scene& scene, const std::vector<Digest>& digests) {
  FirstUse<Texture> first_use(scene.textures, digests);
  for (Material& material : scene.materials) {
    for (TextureRef* ref : {&material.base_texture, &material.emission_texture}) {
      if (ref->texture >= 0) ref->texture = first_use.NumberOf(ref->texture);
    }
  }
  first_use.Finish();
}

}  // namespace

void Canonicalize(Scene& scene) {
  const auto texture_digests = DigestsOf(scene.textures, [](const Texture& texture) {
    return DigestOf([&](ByteWriter& writer) { PutTexture(writer, texture); });
  });
  const auto material_digests =
      DigestsOf(scene.materials, [&](const Material& material) { return MaterialDigest(material, texture_digests); });
  const auto object_digests = DigestsOf(scene.objects, [&](const Object& object) {
    return DigestOf([&](ByteWriter& writer) {
      writer.Put(material_digests.at(object.material).bytes);
      PutGeometry(writer, object);
    });
  });
  const auto light_digests = DigestsOf(scene.lights, [](const PunctualLight& light) {
    return DigestOf([&](ByteWriter& writer) { PutLight(writer, light); });
  });
  SortByDigest(scene.objects, object_digests);
  SortByDigest(scene.lights, light_digests);
  RenumberMaterials(scene, material_digests);
  RenumberTextures(scene, texture_digests);
}

}  // namespace bakewell
