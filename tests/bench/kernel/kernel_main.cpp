#include <benchmark/benchmark.h>
#include <tbb/task_arena.h>

#include <functional>
#include <iostream>

#include "tests/bench/kernel/kernel_level.h"
#include "worker/finish/filter.h"
#include "worker/finish/page.h"
#include "worker/gather/accumulate.h"
#include "worker/sample/hash.h"
#include "worker/trace/float_mode.h"

// bench_kernel [--benchmark_...] LEVEL...: nanoseconds of each kernel a unit (items), and of the rays of a real gather
// beside bare Embree calls with the very same rays. One thread.
namespace bakewell {
namespace {

class NoProgress : public Progress {
 public:
  void Report(std::string_view, int64_t, int64_t) override {}
};

using Body = std::function<int64_t()>;  // returns how many units it did

void Register(const KernelLevel& level, const std::string& kernel, Body body) {
  benchmark::RegisterBenchmark((level.name + "/" + kernel).c_str(), [body = std::move(body)](benchmark::State& state) {
    const FlushDenormals mode;
    int64_t units = 0;
    for (auto _ : state) units += body();
    state.SetItemsProcessed(units);
    state.counters["ns"] = benchmark::Counter(static_cast<double>(units) * 1e-9,
                                              benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  })->Unit(benchmark::kMillisecond);
}

Ray RayOf(const RTCRay& r) { return {{r.org_x, r.org_y, r.org_z}, {r.dir_x, r.dir_y, r.dir_z}, r.tfar}; }

void RegisterRays(const KernelLevel& level) {
  const World& world = *level.level->world;
  const BareScene& bare = *level.bare;
  const std::span<const RTCRay> nearest(level.rays.nearest), any(level.rays.any);
  const auto units = [](std::span<const RTCRay> rays, int64_t hits) {
    benchmark::DoNotOptimize(hits);
    return std::ssize(rays);
  };
  Register(level, "rays/nearest/ours", [&world, nearest, units] {
    int64_t hits = 0;
    for (const RTCRay& ray : nearest) hits += static_cast<bool>(world.Intersect(RayOf(ray)));
    return units(nearest, hits);
  });
  Register(level, "rays/nearest/bare", [&bare, nearest, units] { return units(nearest, bare.Nearest(nearest)); });
  Register(level, "rays/nearest/bare8",
           [&bare, nearest, units] { return units(nearest, bare.NearestInPackets(nearest)); });
  Register(level, "rays/any/ours", [&world, any, units] {
    int64_t hits = 0;
    for (const RTCRay& ray : any) hits += world.Occluded(RayOf(ray));
    return units(any, hits);
  });
  Register(level, "rays/any/bare", [&bare, any, units] { return units(any, bare.Any(any)); });
  Register(level, "rays/any/bare8", [&bare, any, units] { return units(any, bare.AnyInPackets(any)); });
}

void RegisterPhotons(const KernelLevel& k) {
  Register(k, "photon", [&k] {
    NoProgress progress;
    PhotonMap map;
    map.flux.resize(k.photons.flux.size());
    const int64_t end = std::min<int64_t>(k.stage->plan.photons, 200000);
    EmitPhotons(*k.level->world, *k.level->lights, k.stage->guide, k.stage->cells, k.stage->plan, 0, end, progress,
                map);
    return end;
  });
  Register(k, "density", [&k] {
    NoProgress progress;
    tbb::task_arena one(1);
    one.execute([&] { EstimateDensity(*k.level->world, k.stage->cells, k.photons, k.stage->plan, {}, progress); });
    return std::ssize(k.photons.flux);
  });
}

void RegisterTexels(const KernelLevel& k) {
  const Level& level = *k.level;
  Register(k, "rasterise", [&k, &level] {
    return std::ssize(RasterizeTexels(*level.world, level.layout, k.texels->footprint).texels);
  });
  for (const int samples : {8, 64}) {
    Register(k, "gather/" + std::to_string(samples), [&k, &level, samples] {
      GatherOptions options = k.options;
      options.min_samples = options.max_samples = samples;
      GatherCounters counters;
      int64_t texels = 0;
      for (const int tile : k.Tiles(8))
        texels += std::ssize(GatherTile(k.scene(), level.layout, *k.texels, tile, options, counters));
      return texels;
    });
  }
  auto lights = std::make_shared<std::vector<TexelLight>>();
  GatherOptions options = k.options;
  options.min_samples = options.max_samples = 8;
  for (int tile = 0; tile < k.texels->tile_count(); ++tile) {
    GatherCounters counters;
    const auto some = GatherTile(k.scene(), level.layout, *k.texels, tile, options, counters);
    lights->insert(lights->end(), some.begin(), some.end());
  }
  Register(k, "filter", [&k, lights] {
    std::vector<TexelLight> copy = *lights;
    FilterCounters counters;
    tbb::task_arena one(1);
    one.execute([&] { FilterPage(*k.texels, 0, copy, {}, counters); });
    return std::ssize(copy);
  });
  Register(k, "finish", [&k, lights] {
    benchmark::DoNotOptimize(FinishPage(*k.texels, *lights, 0));
    return std::ssize(*lights);
  });
}

void RegisterSamples(const KernelLevel& k) {
  Register(k, "accumulate", [&k] {
    Accumulator sum;
    const uint32_t count = 4096;
    for (uint32_t i = 0; i < count; ++i) {
      const RTCRay& ray = k.rays.nearest[i % k.rays.nearest.size()];
      sum.Count();
      sum.AddIrradiance(i, count, {1, 1, 1});
      sum.AddSh({ray.dir_x, ray.dir_y, ray.dir_z}, {1, 1, 1});
    }
    benchmark::DoNotOptimize(sum.Sh());
    return static_cast<int64_t>(count);
  });
  if (k.tree->empty()) return;
  Register(k, "light_tree", [&k] {
    int64_t drawn = 0;
    for (size_t i = 0; i < k.texels->texels.size(); i += 7, ++drawn) {
      const Texel& texel = k.texels->texels[i];
      const float u = UnitFloat(HashWide(i));
      benchmark::DoNotOptimize(k.tree->Draw(LightTree::kRoot, {texel.position, texel.normal}, u));
    }
    return drawn;
  });
}

}  // namespace
}  // namespace bakewell

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  std::vector<std::unique_ptr<bakewell::KernelLevel>> levels;
  for (int i = 1; i < argc; ++i) {
    auto level = bakewell::LoadKernelLevel(argv[i]);
    if (!level.ok()) {
      std::cerr << level.status() << "\n";
      return 1;
    }
    levels.push_back(*std::move(level));
    bakewell::RegisterRays(*levels.back());
    bakewell::RegisterPhotons(*levels.back());
    bakewell::RegisterTexels(*levels.back());
    bakewell::RegisterSamples(*levels.back());
  }
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
