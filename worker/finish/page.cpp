#include "worker/finish/page.h"

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

// Grows the set of known texels by rings of one texel: an unknown texel becomes the mean of its known neighbours that
// `accept` allows. Values of unknown texels are overwritten, those of known ones kept.
class Filler {
 public:
  Filler(std::vector<Image*> images, int width, int height)
      : images_(std::move(images)), width_(width), height_(height) {
    known_.assign(static_cast<size_t>(width) * static_cast<size_t>(height), 0);
  }

  void MarkKnown(int x, int y) { known_[At(x, y)] = 1; }
  bool Known(int x, int y) const { return known_[At(x, y)] != 0; }

  // want(x, y): may be filled. accept(x, y, nx, ny): may be filled from that neighbour. Returns texels still unknown.
  template <typename Want, typename Accept>
  void Grow(int rings, Want want, Accept accept) {
    for (int ring = 0; ring < rings; ++ring) {
      std::vector<std::pair<int, int>> filled;
      for (int y = 0; y < height_; ++y) {
        for (int x = 0; x < width_; ++x) {
          if (!Known(x, y) && want(x, y) && FillOne(x, y, accept)) filled.push_back({x, y});
        }
      }
      if (filled.empty()) return;
      for (const auto& [x, y] : filled) MarkKnown(x, y);
    }
  }

 private:
  size_t At(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
  }

  template <typename Accept>
  bool FillOne(int x, int y, Accept accept) {
    std::vector<std::pair<int, int>> from;
    for (int ny = std::max(0, y - 1); ny <= std::min(height_ - 1, y + 1); ++ny) {
      for (int nx = std::max(0, x - 1); nx <= std::min(width_ - 1, x + 1); ++nx) {
        if (Known(nx, ny) && accept(x, y, nx, ny)) from.push_back({nx, ny});
      }
    }
    if (from.empty()) return false;
    for (Image* image : images_) {
      for (int c = 0; c < static_cast<int>(image->channels.size()); ++c) {
        if (image->channels[c] == "A") continue;
        float sum = 0;
        for (const auto& [nx, ny] : from) sum += image->At(c, nx, ny);
        image->At(c, x, y) = sum / static_cast<float>(from.size());
      }
    }
    return true;
  }

  std::vector<Image*> images_;
  int width_, height_;
  std::vector<uint8_t> known_;
};

void PutTexel(const Texel& texel, const TexelLight& light, PageImages& images) {
  const RadianceSh sh = Windowed(light.sh, WindowStrength(light.sh));
  for (int c = 0; c < 3; ++c) {
    images.irradiance.At(c, texel.x, texel.y) = light.irradiance[c];
    images.variance.At(c, texel.x, texel.y) = light.variance[c];
    for (int i = 0; i < kShCoefficients; ++i) images.sh.At(3 * i + c, texel.x, texel.y) = sh.lambda[i][c];
  }
  images.irradiance.At(3, texel.x, texel.y) = std::min(texel.coverage, 1.0f);
  images.variance.At(3, texel.x, texel.y) = light.backface_share;
}

}  // namespace

PageImages FinishPage(const TexelMap& map, std::span<const TexelLight> lights, int page) {
  const PageSize size = map.pages[page];
  PageImages images{Image(size.width, size.height, {"R", "G", "B", "A"}), Image(size.width, size.height, ShChannels()),
                    Image(size.width, size.height, {"R", "G", "B", "A"})};
  Filler filler({&images.irradiance, &images.sh, &images.variance}, size.width, size.height);
  const std::vector<int32_t>& texel_at = map.texel_at[page];
  const auto index = [&](int x, int y) {
    return texel_at[static_cast<size_t>(y) * static_cast<size_t>(size.width) + static_cast<size_t>(x)];
  };
  for (size_t i = 0; i < map.texels.size(); ++i) {
    if (map.texels[i].page != page) continue;
    PutTexel(map.texels[i], lights[i], images);
    if (lights[i].valid) filler.MarkKnown(map.texels[i].x, map.texels[i].y);
  }
  const auto covered = [&](int x, int y) { return index(x, y) >= 0; };
  const auto same_chart = [&](int x, int y, int nx, int ny) {
    return index(nx, ny) >= 0 && map.texels[index(x, y)].chart == map.texels[index(nx, ny)].chart;
  };
  filler.Grow(std::max(size.width, size.height), covered, same_chart);
  filler.Grow(
      kGutterTexels, [&](int x, int y) { return !covered(x, y); }, [](int, int, int, int) { return true; });
  return images;
}

}  // namespace bakewell
