#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/status.h"
#include "core/image/image.h"

// The error measures of theory.md 9, the only ones that tests and benchmarks use. All are on luminance
// Y = 0.2126 R + 0.7152 G + 0.0722 B, over the texels of a mask, in double precision. Pure functions, any thread.
namespace bakewell {

// Which texels count: row 0 on top, 1 inside, 0 outside.
struct TexelMask {
  int width = 0, height = 0;
  std::vector<uint8_t> inside;  // width * height

  int64_t Count() const;
};

// Inside where the R channel (of ReadPng, so in 0..1) times 255 is at least `min_value`, 0..255.
absl::StatusOr<TexelMask> MaskFromPicture(const Image& picture, int min_value);

// Inside where channel A is above 0; everywhere if there is no channel A.
TexelMask MaskFromCoverage(const Image& image);

// `mask` without the texels at least 2 % of whose hemisphere sees a back face first: they reach into a solid.
// `backface` has that share in its first channel (R, Y or the only one). kInvalidArgument where the sizes differ.
absl::StatusOr<TexelMask> WithoutBackfaces(TexelMask mask, const Image& backface);

// What CompareImages looks at. Images have channels R, G, B; all are of the mask's size.
struct Comparison {
  const Image* candidate = nullptr;  // E, required
  const Image* reference = nullptr;  // R, required
  const TexelMask* mask = nullptr;   // required
  const Image* half_a = nullptr;     // two independent halves of the reference, both or neither
  const Image* half_b = nullptr;
  const Image* standard_error = nullptr;  // of the reference's luminance, first channel
};

// d = E - R, m = mean(R). Any non-finite texel makes the figures it enters NaN and is counted.
struct ErrorFigures {
  int64_t texels = 0;
  int64_t nonfinite = 0;                    // texels whose candidate is NaN or infinite
  double mean_reference = 0;                // m [W/m2]
  double mean_candidate = 0;                // [W/m2]
  double bias = 0;                          // mean(d) / m
  double rel_rmse = 0;                      // sqrt(mean(d^2)) / m
  double rel_mse = 0;                       // mean(d^2 / (R^2 + (0.01 m)^2))
  double p50 = 0, p95 = 0;                  // percentiles of |d| / (R + 0.01 m), linear between order statistics
  std::optional<double> reference_noise;    // root mean square of standard_error / m
  std::optional<double> rel_rmse_debiased;  // sqrt(max(0, rel_rmse^2 - reference_noise^2))
  std::optional<double> rel_rmse_cross;     // sqrt(max(0, mean((E - A)(E - B)))) / mean((A + B) / 2)
};

// kInvalidArgument, saying which: sizes differ, a channel is absent, no texel in the mask, one half without the other.
absl::StatusOr<ErrorFigures> CompareImages(const Comparison& comparison);

// d as a picture: blue where the candidate is darker, white where equal, red where brighter, full colour at
// -scale and +scale, grey outside the mask, magenta where d is not finite.
struct DifferencePicture {
  std::vector<uint8_t> rgb;  // 3 * width * height, row 0 on top
  double scale = 0;          // 99th percentile of |d| [W/m2]; 1 where all d are 0
};

// Errors as CompareImages; looks at candidate, reference and mask only.
absl::StatusOr<DifferencePicture> DrawDifference(const Comparison& comparison);

}  // namespace bakewell
