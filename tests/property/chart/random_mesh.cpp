#include "tests/property/chart/random_mesh.h"

#include <cmath>
#include <limits>
#include <utility>

namespace bakewell::chart {
namespace {

// splitmix64 (Steele, Lea & Flood 2014).
class Random {
 public:
  explicit Random(uint64_t key) : state_(key * 0x9E3779B97F4A7C15ull) {}
  uint64_t Next() {
    uint64_t z = (state_ += 0x9E3779B97F4A7C15ull);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
    return z ^ (z >> 31);
  }
  uint32_t Below(size_t n) { return static_cast<uint32_t>(Next() % n); }
  float Unit() { return static_cast<float>(Next() >> 40) * 0x1p-24f; }
  bool Chance(float share) { return Unit() < share; }

 private:
  uint64_t state_;
};

Vec3f RandomPoint(Random& random) { return {random.Unit(), random.Unit(), random.Unit()}; }

void AddSoup(Random& random, RandomMesh& mesh) {
  const uint32_t vertices = 3 + random.Below(60), faces = 1 + random.Below(120);
  const uint32_t base = static_cast<uint32_t>(mesh.position.size());
  for (uint32_t i = 0; i < vertices; ++i) mesh.position.push_back(RandomPoint(random));
  for (uint32_t i = 0; i < 3 * faces; ++i) mesh.index.push_back(base + random.Below(vertices));
}

// A grid bent and roughened; closed to a tube or a torus half of the time.
void AddGrid(Random& random, RandomMesh& mesh) {
  const uint32_t columns = 2 + random.Below(14), rows = 2 + random.Below(14);
  const uint32_t base = static_cast<uint32_t>(mesh.position.size());
  const float bend = random.Chance(0.5f) ? 6.2831853f * random.Unit() : 0,
              rough = random.Chance(0.5f) ? 0.2f * random.Unit() : 0;
  const bool tube = random.Chance(0.3f);
  for (uint32_t y = 0; y < rows; ++y)
    for (uint32_t x = 0; x < columns; ++x) {
      const float u = static_cast<float>(x) / static_cast<float>(columns),
                  v = static_cast<float>(y) / static_cast<float>(rows);
      const Vec3f p{std::cos(bend * u) * (1 + v), std::sin(bend * u) * (1 + v) + (bend == 0 ? u : 0), tube ? v * v : v};
      mesh.position.push_back(p + RandomPoint(random) * rough);
    }
  for (uint32_t y = 0; y + 1 < rows; ++y)
    for (uint32_t x = 0; x + (tube ? 0 : 1) < columns; ++x) {
      const uint32_t a = base + y * columns + x, b = base + y * columns + (x + 1) % columns;
      mesh.index.insert(mesh.index.end(), {a, b, b + columns, a, b + columns, a + columns});
    }
}

// Triangles around one vertex; more than a full turn now and then.
void AddFan(Random& random, RandomMesh& mesh) {
  const uint32_t spokes = 3 + random.Below(40), base = static_cast<uint32_t>(mesh.position.size());
  const float turn = 9 * random.Unit(), height = random.Unit();
  mesh.position.push_back({0, 0, height});
  for (uint32_t i = 0; i <= spokes; ++i) {
    const float a = turn * static_cast<float>(i) / static_cast<float>(spokes);
    mesh.position.push_back({std::cos(a), std::sin(a), height * std::sin(3 * a)});
  }
  for (uint32_t i = 1; i <= spokes; ++i) mesh.index.insert(mesh.index.end(), {base, base + i, base + i + 1});
}

void AddSlivers(Random& random, RandomMesh& mesh) {
  const float width = std::pow(10.0f, -8 * random.Unit());
  for (uint32_t i = 0; i < 1 + random.Below(10); ++i) {
    const uint32_t base = static_cast<uint32_t>(mesh.position.size());
    const Vec3f p = RandomPoint(random), q = RandomPoint(random);
    mesh.position.insert(mesh.position.end(), {p, q, p * 0.5f + q * 0.5f + RandomPoint(random) * width});
    mesh.index.insert(mesh.index.end(), {base, base + 1, base + 2});
  }
}

void Damage(Random& random, RandomMesh& mesh) {
  const size_t triangles = mesh.index.size() / 3;
  for (size_t t = 0; t < triangles; ++t) {
    if (random.Chance(0.02f)) mesh.index[3 * t] = mesh.index[3 * t + 1];
    if (random.Chance(0.02f)) std::swap(mesh.index[3 * t], mesh.index[3 * t + 1]);
    if (random.Chance(0.03f))
      for (int k : {0, 1, 2}) mesh.index.push_back(mesh.index[3 * t + k]);
    if (random.Chance(0.02f))
      for (int k : {2, 1, 0}) mesh.index.push_back(mesh.index[3 * t + k]);
  }
  if (random.Chance(0.2f))
    mesh.position[random.Below(mesh.position.size())].y = std::numeric_limits<float>::quiet_NaN();
  if (random.Chance(0.1f)) mesh.position[random.Below(mesh.position.size())].x = std::numeric_limits<float>::infinity();
  if (random.Chance(0.3f)) mesh.position.push_back(RandomPoint(random));
}

}  // namespace

RandomMesh MakeRandomMesh(uint64_t key) {
  Random random(key);
  RandomMesh mesh;
  const uint32_t parts = 1 + random.Below(3);
  for (uint32_t i = 0; i < parts; ++i) {
    switch (random.Below(4)) {
      case 0:
        AddSoup(random, mesh);
        break;
      case 1:
        AddGrid(random, mesh);
        break;
      case 2:
        AddFan(random, mesh);
        break;
      default:
        AddSlivers(random, mesh);
    }
  }
  if (random.Chance(0.5f)) Damage(random, mesh);
  const float scale = std::pow(10.0f, 12 * random.Unit() - 6);
  for (Vec3f& p : mesh.position) p = p * scale;
  return mesh;
}

}  // namespace bakewell::chart
