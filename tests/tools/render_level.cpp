// Draws a baked level as a camera sees it: albedo / pi * E from the lightmap, bilinear, plus emission and sky.
//   render_level scene.glb baked_folder picture.png  px py pz  tx ty tz  [fov_degrees] [width height]
// The bake must have used default settings but for --quality, so that the same charts come out again.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include "client/local/level_bake.h"
#include "core/image/exr.h"
#include "core/image/png.h"
#include "tests/support/bake_scene.h"

namespace bakewell {
namespace {

struct Camera {
  Vec3f position, right, up, forward;
  float tan_half = 1, aspect = 1;
};

Vec3f Argument(char** words) {
  return {static_cast<float>(std::atof(words[0])), static_cast<float>(std::atof(words[1])),
          static_cast<float>(std::atof(words[2]))};
}

Rgb Bilinear(const Image& page, float x, float y) {
  const float fx = std::floor(x - 0.5f), fy = std::floor(y - 0.5f), wx = x - 0.5f - fx, wy = y - 0.5f - fy;
  Rgb sum;
  for (int k = 0; k < 4; ++k) {
    const int px = std::clamp(static_cast<int>(fx) + k % 2, 0, page.width - 1);
    const int py = std::clamp(static_cast<int>(fy) + k / 2, 0, page.height - 1);
    const float weight = (k % 2 ? wx : 1 - wx) * (k / 2 ? wy : 1 - wy);
    for (int c = 0; c < 3; ++c) sum[c] += weight * page.At(c, px, py);
  }
  return sum;
}

Rgb Shade(const PreparedLevel& level, const std::vector<Image>& pages, const Ray& ray) {
  const World& world = *level.world;
  const Hit hit = world.Intersect(ray);
  if (!hit) return level.lights->environment().Radiance(ray.dir);
  const Triangle& t = world.triangles()[hit.triangle];
  const ObjectCharts& charts = level.layout.objects[t.object];
  Rgb radiance = world.EmissionAt(hit);
  if (charts.index.empty() || charts.chart_of_triangle[t.index_in_object] == kNoChart) return radiance;
  const auto c = TexelCorners(world, level.layout, hit.triangle);
  const double u = static_cast<double>(hit.u), v = static_cast<double>(hit.v);
  const Vec2d p = c[0] * (1 - u - v) + c[1] * u + c[2] * v;
  const Image& page = pages[level.layout.charts[charts.chart_of_triangle[t.index_in_object]].page];
  return radiance + Bilinear(page, static_cast<float>(p.x), static_cast<float>(p.y)) * world.AlbedoAt(hit) * kInvPiF;
}

Image Render(const PreparedLevel& level, const std::vector<Image>& pages, const Camera& camera, int width, int height) {
  Image picture(width, height, {"R", "G", "B", "A"});
  constexpr int kSide = 3;  // samples a pixel, squared
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      Rgb sum;
      for (int s = 0; s < kSide * kSide; ++s) {
        const float px =
            (static_cast<float>(x) + (static_cast<float>(s % kSide) + 0.5f) / kSide) / static_cast<float>(width) * 2 -
            1;
        const float py = 1 - (static_cast<float>(y) + (static_cast<float>(s / kSide) + 0.5f) / kSide) /
                                 static_cast<float>(height) * 2;
        const Vec3f dir =
            camera.forward + camera.right * (px * camera.tan_half * camera.aspect) + camera.up * (py * camera.tan_half);
        sum += Shade(
            level, pages,
            {camera.position, NormalizeOrZero(dir), std::numeric_limits<float>::infinity(), static_cast<uint32_t>(s)});
      }
      for (int c = 0; c < 3; ++c) picture.At(c, x, y) = sum[c] / (kSide * kSide);
      picture.At(3, x, y) = 1;
    }
  }
  return picture;
}

int Main(int argc, char** argv) {
  if (argc < 10) {
    std::fprintf(stderr,
                 "usage: render_level scene.glb baked_folder picture.png px py pz tx ty tz [fov] [width height]\n");
    return 2;
  }
  auto loaded = LoadLevel(argv[1]);
  PhaseClock clock;
  SilentProgress progress;
  if (!loaded.ok()) return std::fprintf(stderr, "%s\n", std::string(loaded.status().message()).c_str()), 2;
  auto level = PrepareLevel(*std::move(loaded), {}, clock, progress);
  if (!level.ok()) return std::fprintf(stderr, "%s\n", std::string(level.status().message()).c_str()), 2;
  std::vector<Image> pages;
  for (size_t i = 0; i < level->texels.pages.size(); ++i) {
    auto page = ReadExr(std::filesystem::path(argv[2]) / ("lightmap-" + std::to_string(i) + ".irradiance.exr"));
    if (!page.ok()) return std::fprintf(stderr, "%s\n", std::string(page.status().message()).c_str()), 2;
    // Channels come in alphabetical order: A B G R.
    Image rgb(page->width, page->height, {"R", "G", "B"});
    for (int c = 0; c < 3; ++c) std::copy_n(page->Channel(3 - c).begin(), rgb.PixelCount(), rgb.Channel(c).begin());
    pages.push_back(std::move(rgb));
  }
  const int width = argc > 12 ? std::atoi(argv[11]) : 960, height = argc > 12 ? std::atoi(argv[12]) : 540;
  Camera camera;
  camera.position = Argument(argv + 4) - ToFloat(level->level->scene.origin_ws);
  camera.forward = NormalizeOrZero(Argument(argv + 7) - Argument(argv + 4));
  camera.right = NormalizeOrZero(Cross(camera.forward, Vec3f{0, 1, 0}));
  camera.up = Cross(camera.right, camera.forward);
  camera.tan_half = std::tan((argc > 10 ? static_cast<float>(std::atof(argv[10])) : 60.0f) * kPiF / 360);
  camera.aspect = static_cast<float>(width) / static_cast<float>(height);
  const absl::Status written =
      WritePng(argv[3], width, height, TonemapPreview(Render(*level, pages, camera, width, height)));
  if (!written.ok()) return std::fprintf(stderr, "%s\n", std::string(written.message()).c_str()), 1;
  return 0;
}

}  // namespace
}  // namespace bakewell

int main(int argc, char** argv) { return bakewell::Main(argc, argv); }
