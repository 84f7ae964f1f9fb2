#include "worker/finish/page.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

#include "worker/finish/ringing.h"

namespace bakewell {
namespace {

std::vector<std::string> ShChannels() {
  std::vector<std::string> names;
  for (int i = 0; i < kShCoefficients; ++i) {
    for (const char* channel : {"R", "G", "B"}) names.push_back("sh" + std::to_string(i) + "." + channel);
  }
  return names;
}

// The channels that are light, one after the other: all but coverage and back faces.
std::vector<float*> LightPlanes(PageImages& images) {
  std::vector<float*> planes;
  for (Image* image : {&images.irradiance, &images.sh, &images.variance}) {
    for (size_t c = 0; c < image->channels.size(); ++c) {
      if (image->channels[c] != "A") planes.push_back(image->Channel(static_cast<int>(c)).data());
    }
  }
  return planes;
}

// Grows the set of known texels by rings of one texel: an unknown texel becomes the mean of its known neighbours that
// `accept` allows. Values of unknown texels are overwritten, those of known ones kept. Texels by their place on the
// page, row by row.
class Filler {
 public:
  Filler(std::vector<float*> planes, PageSize size)
      : planes_(std::move(planes)),
        width_(size.width),
        height_(size.height),
        known_(static_cast<size_t>(size.width) * static_cast<size_t>(size.height), 0) {}

  void MarkKnown(size_t at) { known_[at] = 1; }

  // want(at): may be filled. accept(at, neighbour): may be filled from that neighbour.
  template <typename Want, typename Accept>
  void Grow(int rings, Want want, Accept accept) {
    std::vector<size_t> wanted, filled;
    for (size_t at = 0; at < known_.size(); ++at) {
      if (known_[at] == 0 && want(at)) wanted.push_back(at);
    }
    for (int ring = 0; ring < rings; ++ring) {
      filled.clear();
      std::erase_if(wanted, [&](size_t at) {
        const bool fills = FillOne(at, accept);
        if (fills) filled.push_back(at);
        return fills;
      });
      if (filled.empty()) return;
      for (const size_t at : filled) MarkKnown(at);
    }
  }

 private:
  template <typename Accept>
  bool FillOne(size_t at, Accept accept) {
    const int x = static_cast<int>(at % static_cast<size_t>(width_)),
              y = static_cast<int>(at / static_cast<size_t>(width_));
    std::array<size_t, 8> from;
    size_t count = 0;
    for (int ny = std::max(0, y - 1); ny <= std::min(height_ - 1, y + 1); ++ny) {
      for (int nx = std::max(0, x - 1); nx <= std::min(width_ - 1, x + 1); ++nx) {
        const size_t neighbour = static_cast<size_t>(ny) * static_cast<size_t>(width_) + static_cast<size_t>(nx);
        if (known_[neighbour] != 0 && accept(at, neighbour)) from[count++] = neighbour;
      }
    }
    if (count == 0) return false;
    for (float* plane : planes_) {
      float sum = 0;
      for (size_t i = 0; i < count; ++i) sum += plane[from[i]];
      plane[at] = sum / static_cast<float>(count);
    }
    return true;
  }

  const std::vector<float*> planes_;
  const int width_, height_;
  std::vector<uint8_t> known_;
};

// Texels that are put side by side.
struct TexelBatch {
  std::array<size_t, kRingingLanes> at;
  std::array<const Texel*, kRingingLanes> texel;
  std::array<const TexelLight*, kRingingLanes> light;
  size_t count = 0;
};

void PutTexels(const TexelBatch& batch, PageImages& images) {
  std::array<const RadianceSh*, kRingingLanes> sh;
  for (size_t k = 0; k < batch.count; ++k) sh[k] = &batch.light[k]->sh;
  const auto strengths = WindowStrengths(std::span(sh).first(batch.count));
  for (size_t k = 0; k < batch.count; ++k) {
    const size_t at = batch.at[k];
    const TexelLight& light = *batch.light[k];
    const RadianceSh windowed = Windowed(light.sh, strengths[k]);
    for (int c = 0; c < 3; ++c) {
      images.irradiance.Channel(c)[at] = light.irradiance[c];
      images.variance.Channel(c)[at] = light.variance[c];
      for (int i = 0; i < kShCoefficients; ++i) images.sh.Channel(3 * i + c)[at] = windowed.lambda[i][c];
    }
    images.irradiance.Channel(3)[at] = std::min(batch.texel[k]->coverage, 1.0f);
    images.variance.Channel(3)[at] = light.backface_share;
  }
}

}  // namespace

PageImages FinishPage(const TexelMap& map, std::span<const TexelLight> lights, int page) {
  const PageSize size = map.pages[page];
  PageImages images{Image(size.width, size.height, {"R", "G", "B", "A"}), Image(size.width, size.height, ShChannels()),
                    Image(size.width, size.height, {"R", "G", "B", "A"})};
  Filler filler(LightPlanes(images), size);
  const std::vector<int32_t>& texel_at = map.texel_at[page];
  constexpr size_t kGrain = 4096;  // places on the page
  tbb::parallel_for(tbb::blocked_range<size_t>(0, texel_at.size(), kGrain),
                    [&](const tbb::blocked_range<size_t>& some) {
                      TexelBatch batch;
                      for (size_t at = some.begin(); at < some.end(); ++at) {
                        if (texel_at[at] < 0) continue;
                        const auto i = static_cast<size_t>(texel_at[at]);
                        if (lights[i].valid) filler.MarkKnown(at);
                        batch.at[batch.count] = at;
                        batch.texel[batch.count] = &map.texels[i];
                        batch.light[batch.count++] = &lights[i];
                        if (batch.count < kRingingLanes) continue;
                        PutTexels(batch, images);
                        batch.count = 0;
                      }
                      PutTexels(batch, images);
                    });
  const auto covered = [&](size_t at) { return texel_at[at] >= 0; };
  const auto same_chart = [&](size_t at, size_t neighbour) {
    return covered(neighbour) && map.texels[texel_at[at]].chart == map.texels[texel_at[neighbour]].chart;
  };
  filler.Grow(std::max(size.width, size.height), covered, same_chart);
  filler.Grow(
      kGutterTexels, [&](size_t at) { return !covered(at); }, [](size_t, size_t) { return true; });
  return images;
}

}  // namespace bakewell
