#include "worker/finish/bands.h"

#include <array>
#include <cmath>
#include <map>
#include <vector>

namespace bakewell {
namespace {

// A_l sqrt((2 l + 1)/(4 pi)) (theory.md 2).
constexpr std::array<float, 3> kMostOfBand = {0, 2 * kPiF / 3 * 0.488603f, kPiF / 4 * 0.630783f};

// Luminance of the channels' lengths: colours do not cancel.
float LengthOfBand(const RadianceSh& sh, int l) {
  Rgb square;
  for (int i = l * l; i < (l + 1) * (l + 1); ++i) square += sh.lambda[i] * sh.lambda[i];
  return Luminance(Rgb{std::sqrt(square.x), std::sqrt(square.y), std::sqrt(square.z)});
}

}  // namespace

void DropBands(const TexelMap& map, int page, float target_error, float floor_share, std::span<TexelLight> lights,
               SkipCount& count) {
  std::map<int32_t, std::vector<size_t>> charts;
  double sum = 0, texels = 0;
  for (size_t i = 0; i < map.texels.size(); ++i) {
    if (map.texels[i].page != page || !lights[i].valid) continue;
    charts[map.texels[i].chart].push_back(i);
    sum += static_cast<double>(Luminance(lights[i].irradiance));
    texels += 1;
  }
  const float mean = texels > 0 ? static_cast<float>(sum / texels) : 0;
  for (const auto& [chart, members] : charts) {
    count.of += 2;
    for (const int l : {2, 1}) {
      double square = 0;
      for (const size_t i : members) {
        const float tolerated =
            target_error * std::sqrt(mean * std::max(Luminance(lights[i].irradiance), floor_share * mean));
        const float most = kMostOfBand[static_cast<size_t>(l)] * LengthOfBand(lights[i].sh, l);
        square += most > 0 ? std::pow(static_cast<double>(most) / static_cast<double>(tolerated), 2) : 0;
      }
      if (!(square <= static_cast<double>(members.size()))) break;
      if (square <= 0) continue;
      ++count.skipped;
      count.saved += (2 * l + 1) * std::ssize(members);
      for (const size_t i : members) {
        for (int k = l * l; k < (l + 1) * (l + 1); ++k) lights[i].sh.lambda[k] = {};
      }
    }
  }
}

}  // namespace bakewell
