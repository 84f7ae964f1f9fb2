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

void DropBands(const TexelMap& map, int page, float target_error, std::span<TexelLight> lights, SkipCount& count) {
  std::map<int32_t, std::vector<size_t>> charts;
  for (size_t i = 0; i < map.texels.size(); ++i) {
    if (map.texels[i].page == page && lights[i].valid) charts[map.texels[i].chart].push_back(i);
  }
  for (const auto& [chart, members] : charts) {
    count.of += 2;
    double mean = 0;
    for (const size_t i : members)
      mean += static_cast<double>(Luminance(lights[i].irradiance)) / static_cast<double>(members.size());
    const double tolerated = static_cast<double>(target_error) * mean;
    for (const int l : {2, 1}) {
      double square = 0;
      for (const size_t i : members) {
        const double most = static_cast<double>(kMostOfBand[static_cast<size_t>(l)] * LengthOfBand(lights[i].sh, l));
        square += most * most / static_cast<double>(members.size());
      }
      if (!(square <= tolerated * tolerated)) break;
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
