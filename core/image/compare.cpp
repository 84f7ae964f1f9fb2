#include "core/image/compare.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

namespace bakewell {
namespace {

constexpr double kBackfaceLimit = 0.02;
constexpr double kFloor = 0.01;  // share of the mean added to a texel's reference in relative measures

std::string SizeText(int width, int height) { return absl::StrCat(width, " x ", height); }

absl::Status CheckSize(const char* what, const Image& image, const TexelMask& mask) {
  if (image.width == mask.width && image.height == mask.height) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("sizes differ: the ", what, " is ",
                                                 SizeText(image.width, image.height), ", the mask ",
                                                 SizeText(mask.width, mask.height)));
}

// The one channel of a scalar image.
int ScalarChannel(const Image& image) {
  for (const char* const name : {"R", "Y"}) {
    if (const int c = image.ChannelIndex(name); c >= 0) return c;
  }
  return image.channels.empty() ? -1 : 0;
}

// The values of `channel` inside the mask, in row order.
std::vector<double> Inside(const Image& image, int channel, const TexelMask& mask) {
  std::vector<double> values;
  const std::span<const float> texels = image.Channel(channel);
  for (size_t i = 0; i < mask.inside.size(); ++i) {
    if (mask.inside[i]) values.push_back(static_cast<double>(texels[i]));
  }
  return values;
}

absl::StatusOr<std::vector<double>> ScalarInside(const char* what, const Image& image, const TexelMask& mask) {
  BAKEWELL_RETURN_IF_ERROR(CheckSize(what, image, mask));
  const int channel = ScalarChannel(image);
  if (channel < 0) return absl::InvalidArgumentError(absl::StrCat("the ", what, " has no channels"));
  return Inside(image, channel, mask);
}

absl::StatusOr<std::vector<double>> LuminanceInside(const char* what, const Image& image, const TexelMask& mask) {
  constexpr std::array<const char*, 3> kNames = {"R", "G", "B"};
  constexpr std::array<double, 3> kWeights = {0.2126, 0.7152, 0.0722};
  BAKEWELL_RETURN_IF_ERROR(CheckSize(what, image, mask));
  std::vector<double> luminance(static_cast<size_t>(mask.Count()), 0.0);
  for (size_t c = 0; c < kNames.size(); ++c) {
    const int channel = image.ChannelIndex(kNames[c]);
    if (channel < 0) return absl::InvalidArgumentError(absl::StrCat("the ", what, " has no channel ", kNames[c]));
    const std::vector<double> values = Inside(image, channel, mask);
    for (size_t i = 0; i < values.size(); ++i) luminance[i] += kWeights[c] * values[i];
  }
  return luminance;
}

// Mean of f(i) over [0, n), n > 0.
template <typename F>
double MeanOf(size_t n, F f) {
  double sum = 0;
  for (size_t i = 0; i < n; ++i) sum += f(i);
  return sum / static_cast<double>(n);
}

double Mean(const std::vector<double>& values) {
  return MeanOf(values.size(), [&](size_t i) { return values[i]; });
}

// Linear between order statistics; NaN if any value is not finite, since those have no order.
double Percentile(std::vector<double> values, double percent) {
  for (const double value : values) {
    if (!std::isfinite(value)) return std::numeric_limits<double>::quiet_NaN();
  }
  const double rank = percent / 100 * static_cast<double>(values.size() - 1);
  const auto below = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), below, values.end());
  const double low = *below;
  const double high = below + 1 == values.end() ? low : *std::min_element(below + 1, values.end());
  return low + (high - low) * (rank - std::floor(rank));
}

absl::Status CheckComplete(const Comparison& comparison) {
  BAKEWELL_CHECK(comparison.candidate != nullptr && comparison.reference != nullptr && comparison.mask != nullptr);
  if ((comparison.half_a == nullptr) != (comparison.half_b == nullptr)) {
    return absl::InvalidArgumentError("one half of the reference without the other");
  }
  const Image &e = *comparison.candidate, &r = *comparison.reference;
  if (e.width != r.width || e.height != r.height) {
    return absl::InvalidArgumentError(absl::StrCat("sizes differ: the candidate is ", SizeText(e.width, e.height),
                                                   ", the reference ", SizeText(r.width, r.height)));
  }
  if (comparison.mask->Count() == 0) return absl::InvalidArgumentError("no texel is inside the mask");
  return absl::OkStatus();
}

// The figures that need nothing but E and R.
ErrorFigures FiguresOf(const std::vector<double>& e, const std::vector<double>& r) {
  const size_t n = e.size();
  ErrorFigures figures;
  figures.texels = static_cast<int64_t>(n);
  figures.nonfinite = std::count_if(e.begin(), e.end(), [](double x) { return !std::isfinite(x); });
  const double m = Mean(r);
  figures.mean_reference = m;
  figures.mean_candidate = Mean(e);
  figures.bias = MeanOf(n, [&](size_t i) { return e[i] - r[i]; }) / m;
  figures.rel_rmse = std::sqrt(MeanOf(n, [&](size_t i) { return (e[i] - r[i]) * (e[i] - r[i]); })) / m;
  figures.rel_mse =
      MeanOf(n, [&](size_t i) { return (e[i] - r[i]) * (e[i] - r[i]) / (r[i] * r[i] + (kFloor * m) * (kFloor * m)); });

  std::vector<double> relative(n);
  for (size_t i = 0; i < n; ++i) relative[i] = std::abs(e[i] - r[i]) / (r[i] + kFloor * m);
  figures.p50 = Percentile(relative, 50);
  figures.p95 = Percentile(relative, 95);
  return figures;
}

// theory.md 9: unbiased however noisy the halves are.
double RelRmseCross(const std::vector<double>& e, const std::vector<double>& a, const std::vector<double>& b) {
  const double mean_square = MeanOf(e.size(), [&](size_t i) { return (e[i] - a[i]) * (e[i] - b[i]); });
  const double mean = MeanOf(e.size(), [&](size_t i) { return 0.5 * (a[i] + b[i]); });
  return std::sqrt(mean_square < 0 ? 0 : mean_square) / mean;
}

// The colour of t = d / scale into rgb[0..2].
void PutColour(double t, uint8_t* rgb) {
  if (!std::isfinite(t)) {
    rgb[0] = 255, rgb[1] = 0, rgb[2] = 255;
    return;
  }
  const auto faded = static_cast<uint8_t>(std::lround(255 * (1 - std::min(std::abs(t), 1.0))));
  rgb[0] = t < 0 ? faded : 255;
  rgb[1] = faded;
  rgb[2] = t > 0 ? faded : 255;
}

double PictureScale(const std::vector<double>& difference) {
  std::vector<double> magnitudes;
  for (const double d : difference) {
    if (std::isfinite(d)) magnitudes.push_back(std::abs(d));
  }
  const double scale = magnitudes.empty() ? 0 : Percentile(std::move(magnitudes), 99);
  return scale > 0 ? scale : 1;
}

}  // namespace

int64_t TexelMask::Count() const { return std::accumulate(inside.begin(), inside.end(), int64_t{0}); }

absl::StatusOr<TexelMask> MaskFromPicture(const Image& picture, int min_value) {
  const int red = picture.ChannelIndex("R");
  if (red < 0) return absl::InvalidArgumentError("the mask has no channel R");
  TexelMask mask{picture.width, picture.height, {}};
  for (const float value : picture.Channel(red)) mask.inside.push_back(std::round(value * 255) >= float(min_value));
  return mask;
}

TexelMask MaskFromCoverage(const Image& image) {
  TexelMask mask{image.width, image.height, std::vector<uint8_t>(image.PixelCount(), 1)};
  const int alpha = image.ChannelIndex("A");
  for (size_t i = 0; alpha >= 0 && i < mask.inside.size(); ++i) mask.inside[i] = image.Channel(alpha)[i] > 0;
  return mask;
}

absl::StatusOr<TexelMask> WithoutBackfaces(TexelMask mask, const Image& backface) {
  BAKEWELL_RETURN_IF_ERROR(CheckSize("back-face image", backface, mask));
  const int channel = ScalarChannel(backface);
  if (channel < 0) return absl::InvalidArgumentError("the back-face image has no channels");
  const std::span<const float> share = backface.Channel(channel);
  for (size_t i = 0; i < mask.inside.size(); ++i) {
    if (!(static_cast<double>(share[i]) < kBackfaceLimit)) mask.inside[i] = 0;
  }
  return mask;
}

absl::StatusOr<ErrorFigures> CompareImages(const Comparison& comparison) {
  BAKEWELL_RETURN_IF_ERROR(CheckComplete(comparison));
  const TexelMask& mask = *comparison.mask;
  BAKEWELL_ASSIGN_OR_RETURN(const std::vector<double> e, LuminanceInside("candidate", *comparison.candidate, mask));
  BAKEWELL_ASSIGN_OR_RETURN(const std::vector<double> r, LuminanceInside("reference", *comparison.reference, mask));
  ErrorFigures figures = FiguresOf(e, r);
  if (comparison.standard_error != nullptr) {
    BAKEWELL_ASSIGN_OR_RETURN(const std::vector<double> se,
                              ScalarInside("standard error", *comparison.standard_error, mask));
    const double noise = std::sqrt(MeanOf(se.size(), [&](size_t i) { return se[i] * se[i]; })) / figures.mean_reference;
    const double excess = figures.rel_rmse * figures.rel_rmse - noise * noise;
    figures.reference_noise = noise;
    figures.rel_rmse_debiased = std::sqrt(excess < 0 ? 0 : excess);
  }
  if (comparison.half_a != nullptr) {
    BAKEWELL_ASSIGN_OR_RETURN(const std::vector<double> a, LuminanceInside("half A", *comparison.half_a, mask));
    BAKEWELL_ASSIGN_OR_RETURN(const std::vector<double> b, LuminanceInside("half B", *comparison.half_b, mask));
    figures.rel_rmse_cross = RelRmseCross(e, a, b);
  }
  return figures;
}

absl::StatusOr<DifferencePicture> DrawDifference(const Comparison& comparison) {
  BAKEWELL_RETURN_IF_ERROR(CheckComplete(comparison));
  const TexelMask& mask = *comparison.mask;
  BAKEWELL_ASSIGN_OR_RETURN(std::vector<double> d, LuminanceInside("candidate", *comparison.candidate, mask));
  BAKEWELL_ASSIGN_OR_RETURN(const std::vector<double> r, LuminanceInside("reference", *comparison.reference, mask));
  for (size_t i = 0; i < d.size(); ++i) d[i] -= r[i];

  constexpr uint8_t kGrey = 128;
  DifferencePicture picture{std::vector<uint8_t>(mask.inside.size() * 3, kGrey), PictureScale(d)};
  size_t next = 0;
  for (size_t i = 0; i < mask.inside.size(); ++i) {
    if (mask.inside[i]) PutColour(d[next++] / picture.scale, picture.rgb.data() + 3 * i);
  }
  return picture;
}

}  // namespace bakewell
