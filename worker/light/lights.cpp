#include "worker/light/lights.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "worker/light/spherical_triangle.h"
#include "worker/sample/warp.h"

namespace bakewell {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Of the points on a near triangle whose emission varies, by emission; the others by solid angle.
constexpr float kTableShare = 0.9f;

constexpr float kLeastLobe = 0.02f;      // of a light's brightest direction, where it emits at all
constexpr float kLeastPenumbra = 1e-3f;  // of a spot light, between cosines

}  // namespace

float SpotFalloff(const PunctualLight& light, float cos_angle) {
  if (light.type != LightType::kSpot) return 1;
  const float width = light.cos_inner - light.cos_outer;
  if (width <= 0) return cos_angle >= light.cos_outer ? 1.0f : 0.0f;
  const float x = std::clamp((cos_angle - light.cos_outer) / width, 0.0f, 1.0f);
  return x * x;
}

LightSet::LightSet(const World& world, const Environment& environment)
    : world_(world), patterns_(world), environment_(environment) {
  for (const PunctualLight& light : world.scene().lights) {
    if (MaxComponent(light.intensity) <= 0) continue;
    (light.type == LightType::kDirectional ? directionals_ : locals_).push_back(light);
    if (light.type != LightType::kDirectional) continue;
    discs_.push_back({FrameFromHint(-light.direction, light.tangent), std::sin(0.5f * light.angular_diameter_rad)});
  }
  for (const auto& [triangle, mean, table] : patterns_.emitters()) {
    if (light_of_triangle_.empty()) light_of_triangle_.assign(world.triangles().size(), -1);
    light_of_triangle_[triangle] = local_count();
    const Triangle& t = world.triangles()[triangle];
    emissive_.push_back({triangle, 0.5f * Length(Cross(t.e1, t.e2)), mean, world.MaterialOf(t).double_sided, table});
  }
}

int LightSet::LightOfTriangle(uint32_t triangle) const {
  return light_of_triangle_.empty() ? -1 : light_of_triangle_[triangle];
}

namespace {

// Triangles that fill more than this are drawn by solid angle, where single precision resolves the spherical triangle.
constexpr float kSolidAngleThreshold = 0.01f;  // [sr]

SphericalTriangle SeenFrom(const Triangle& t, Vec3f position) {
  return {NormalizeOrZero(t.p0 - position), NormalizeOrZero(t.p0 + t.e1 - position),
          NormalizeOrZero(t.p0 + t.e2 - position)};
}

// Barycentrics of the point where a ray meets a triangle's plane, brought into the triangle.
Vec2f Barycentrics(const Triangle& t, Vec3f origin, Vec3f dir) {
  const Vec3f s = origin - t.p0, h = Cross(dir, t.e2), q = Cross(s, t.e1);
  const float det = Dot(t.e1, h);
  if (det == 0) return {1.0f / 3, 1.0f / 3};
  const float u = std::clamp(Dot(s, h) / det, 0.0f, 1.0f);
  return {u, std::clamp(Dot(dir, q) / det, 0.0f, 1 - u)};
}

}  // namespace

LightSample LightSet::SampleTriangle(const EmissiveTriangle& light, Vec3f position, Vec2f u) const {
  const Triangle& t = world_.triangles()[light.triangle];
  const EmissionTable* table = TableOf(light);
  const SphericalTriangle seen = SeenFrom(t, position);
  const bool near = seen.solid_angle() > kSolidAngleThreshold;
  Vec2f b;
  if (table != nullptr && (!near || u.x < kTableShare)) {
    b = table->Draw(near ? Vec2f{std::min(u.x / kTableShare, 0x1.fffffep-1f), u.y} : u).barycentrics;
  } else if (near) {
    if (table != nullptr) u.x = (u.x - kTableShare) / (1 - kTableShare);
    b = Barycentrics(t, position, seen.Draw(u));
  } else {
    b = TriangleFromSquare(u);
  }
  LightSample sample;
  const Vec3f point = t.p0 + t.e1 * b.x + t.e2 * b.y;
  const Vec3f to_light = point - position;
  const float distance = Length(to_light);
  sample.dir = NormalizeOrZero(to_light);
  const float cos_light = -Dot(sample.dir, t.normal);
  if (!(distance > 0) || cos_light == 0 || (cos_light < 0 && !light.two_sided)) return sample;
  sample.pdf = Pdf(light, seen.solid_angle(), b, std::fabs(cos_light), distance);
  if (!(sample.pdf > 0)) return sample;
  const SurfacePoint end = world_.PointAt(light.triangle, b.x, b.y, cos_light < 0);
  sample.target = RayOrigin(end);
  sample.target_triangle = light.triangle;
  sample.perpendicular = world_.GlowAt(light.triangle, b.x, b.y, cos_light < 0) / sample.pdf;
  return sample;
}

float LightSet::Pdf(const EmissiveTriangle& light, float solid_angle, Vec2f barycentrics, float cos_light,
                    float distance) const {
  const EmissionTable* table = TableOf(light);
  const bool near = solid_angle > kSolidAngleThreshold;
  if (near && table == nullptr) return 1 / solid_angle;
  if (!(cos_light > 0)) return 0;
  const float even = distance * distance / (cos_light * light.area);
  if (table == nullptr) return even;
  const float by_emission = table->Pdf(barycentrics) * even;
  return near ? kTableShare * by_emission + (1 - kTableShare) / solid_angle : by_emission;
}

LightSample LightSet::SampleLocal(int light, Vec3f position, Vec2f u) const {
  if (IsEmissive(light)) return SampleTriangle(emissive_[static_cast<size_t>(light) - locals_.size()], position, u);
  const PunctualLight& punctual = locals_[light];
  LightSample sample;
  const Vec3f to_light = punctual.position - position;
  const float distance2 = Dot(to_light, to_light);
  if (!(distance2 > 0)) return sample;
  sample.dir = NormalizeOrZero(to_light);
  sample.target = punctual.position;
  sample.perpendicular = punctual.intensity * (SpotFalloff(punctual, -Dot(sample.dir, punctual.direction)) / distance2);
  return sample;
}

float LightSet::PdfLocal(int light, Vec3f position, Vec3f dir, const Hit& hit) const {
  const EmissiveTriangle& emissive = emissive_[static_cast<size_t>(light) - locals_.size()];
  const Triangle& triangle = world_.triangles()[emissive.triangle];
  return Pdf(emissive, SeenFrom(triangle, position).solid_angle(), {hit.u, hit.v}, std::fabs(Dot(dir, triangle.normal)),
             hit.t);
}

LightSample LightSet::SampleDirectional(int directional, Vec2f u) const {
  const PunctualLight& light = directionals_[directional];
  LightSample sample;
  sample.infinite = true;
  sample.dir = -light.direction;
  sample.perpendicular = light.intensity;
  if (light.angular_diameter_rad <= 0) return sample;
  // Uniform over the disc's projection, whose density per steradian is cos/(pi sin^2 radius); radiance is
  // E/(pi sin^2 radius), so that each point brings E/cos.
  const Disc& disc = discs_[static_cast<size_t>(directional)];
  const Vec2f d = DiscFromSquare(u) * disc.sin_radius;
  const float z = std::sqrt(std::max(0.0f, 1 - d.x * d.x - d.y * d.y));
  sample.dir = disc.across.ToWorld({d.x, d.y, z});
  sample.perpendicular = light.intensity * (1 / z);
  return sample;
}

LightSample LightSet::SampleEnvironment(Vec2f u) const {
  const auto drawn = environment_.Draw(u);
  LightSample sample;
  sample.infinite = true;
  sample.dir = drawn.dir;
  sample.pdf = drawn.pdf;
  if (drawn.pdf > 0) sample.perpendicular = environment_.Radiance(drawn.dir) / drawn.pdf;
  return sample;
}

LightShape LightSet::ShapeOf(int light) const {
  LightShape shape;
  if (IsEmissive(light)) {
    const EmissiveTriangle& emissive = emissive_[static_cast<size_t>(light) - locals_.size()];
    const Triangle& t = world_.triangles()[emissive.triangle];
    shape.center = t.p0 + (t.e1 + t.e2) * (1.0f / 3);
    for (const Vec3f p : {t.p0, t.p0 + t.e1, t.p0 + t.e2}) {
      shape.radius = std::max(shape.radius, Length(p - shape.center));
    }
    shape.axis = t.normal;
    shape.cone_rad = kPiF / 2;
    shape.two_sided = emissive.two_sided;
    shape.intensity = Luminance(emissive.mean_radiance) * emissive.area;
    shape.softness = 0.5f * emissive.area;
    shape.scale = 1;
    shape.offset = 0;
    shape.least = kLeastLobe;
    return shape;
  }
  const PunctualLight& punctual = locals_[light];
  shape.center = punctual.position;
  shape.intensity = Luminance(punctual.intensity);
  if (punctual.type != LightType::kSpot) return shape;
  shape.axis = punctual.direction;
  shape.cone_rad = std::acos(std::clamp(punctual.cos_outer, -1.0f, 1.0f));
  shape.scale = 1 / std::max(punctual.cos_inner - punctual.cos_outer, kLeastPenumbra);
  shape.offset = -punctual.cos_outer * shape.scale;
  shape.least = kLeastLobe;
  shape.squared = true;
  return shape;
}

float LightSet::Power(int light) const {
  if (IsEmissive(light)) {
    const EmissiveTriangle& e = emissive_[static_cast<size_t>(light) - locals_.size()];
    return Luminance(e.mean_radiance) * e.area * kPiF * (e.two_sided ? 2.0f : 1.0f);
  }
  const PunctualLight& punctual = locals_[light];
  const float solid_angle = punctual.type == LightType::kPoint
                                ? 4 * kPiF
                                : 2 * kPiF * (1 - punctual.cos_inner + (punctual.cos_inner - punctual.cos_outer) / 3);
  return Luminance(punctual.intensity) * solid_angle;
}

Ray ShadowRay(const SurfacePoint& from, const LightSample& sample, uint32_t key) {
  Ray ray = RayFrom(from, sample.dir, kInfinity, key);
  ray.to = sample.target_triangle;
  if (sample.infinite) return ray;
  const Vec3f to_light = sample.target - ray.origin;
  ray.t_max = Length(to_light);
  ray.dir = NormalizeOrZero(to_light);
  return ray;
}

}  // namespace bakewell
