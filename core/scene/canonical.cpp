#include "core/scene/canonical.h"

#include <algorithm>
#include <compare>
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

template <typename T, typename Less>
void SortIndices(std::vector<T>& all, Less less) {
  std::vector<size_t> order(all.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), less);
  std::vector<T> sorted;
  sorted.reserve(all.size());
  for (const size_t i : order) sorted.push_back(std::move(all[i]));
  all = std::move(sorted);
}

template <typename... T>
std::strong_ordering Order(const Vec2<T...>& a, const Vec2<T...>& b) {
  if (const auto x = std::strong_order(a.x, b.x); x != 0) return x;
  return std::strong_order(a.y, b.y);
}

template <typename... T>
std::strong_ordering Order(const Vec3<T...>& a, const Vec3<T...>& b) {
  if (const auto x = std::strong_order(a.x, b.x); x != 0) return x;
  if (const auto y = std::strong_order(a.y, b.y); y != 0) return y;
  return std::strong_order(a.z, b.z);
}

std::strong_ordering Order(float a, float b) { return std::strong_order(a, b); }
std::strong_ordering Order(uint32_t a, uint32_t b) { return a <=> b; }

template <typename T>
std::strong_ordering Order(const std::vector<T>& a, const std::vector<T>& b) {
  if (a.size() != b.size()) return a.size() <=> b.size();
  for (size_t i = 0; i < a.size(); ++i) {
    if (const auto order = Order(a[i], b[i]); order != 0) return order;
  }
  return std::strong_ordering::equal;
}

// The first that is not equal, in the order given.
template <typename... Orders>
std::strong_ordering FirstOf(Orders... orders) {
  std::strong_ordering result = std::strong_ordering::equal;
  ((result = result == 0 ? orders() : result), ...);
  return result;
}

// What stays when a level is moved, turned or scaled comes before what does not: materials have been compared.
std::strong_ordering GeometryOrder(const Object& a, const Object& b) {
  return FirstOf([&] { return a.lightmapped <=> b.lightmapped; }, [&] { return Order(a.density, b.density); },
                 [&] { return Order(a.index, b.index); }, [&] { return Order(a.uv1, b.uv1); },
                 [&] { return Order(a.uv0, b.uv0); }, [&] { return Order(a.position, b.position); },
                 [&] { return Order(a.normal, b.normal); });
}

std::strong_ordering LightOrder(const PunctualLight& a, const PunctualLight& b) {
  return FirstOf([&] { return a.type <=> b.type; }, [&] { return Order(a.cos_inner, b.cos_inner); },
                 [&] { return Order(a.cos_outer, b.cos_outer); },
                 [&] { return Order(a.angular_diameter_rad, b.angular_diameter_rad); },
                 [&] { return Order(a.intensity, b.intensity); }, [&] { return Order(a.position, b.position); },
                 [&] { return Order(a.direction, b.direction); }, [&] { return Order(a.tangent, b.tangent); });
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
  SortIndices(scene.objects, [&](size_t a, size_t b) {
    const Object &x = scene.objects[a], &y = scene.objects[b];
    const Digest &of_x = material_digests.at(x.material), &of_y = material_digests.at(y.material);
    return of_x == of_y ? GeometryOrder(x, y) < 0 : of_x < of_y;
  });
  SortIndices(scene.lights, [&](size_t a, size_t b) { return LightOrder(scene.lights[a], scene.lights[b]) < 0; });
  RenumberMaterials(scene, material_digests);
  RenumberTextures(scene, texture_digests);
}

}  // namespace bakewell
