#include "core/image/compare.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace bakewell {
namespace {

constexpr int kWidth = 8, kHeight = 6;
// Expected values were printed by /work/shared/reference/compare.py for the same images; the two sum in another order.
constexpr double kTolerance = 1e-7;

// ((37 i + 11 c) mod 101) / 100 + 0.05 plus `noise` times a pattern of whole numbers in -8..8.
Image Pattern(float noise) {
  Image image(kWidth, kHeight, {"B", "G", "R"});
  for (int i = 0; i < kWidth * kHeight; ++i) {
    for (int c = 0; c < 3; ++c) {
      const double value = ((i * 37 + c * 11) % 101) * 0.01 + 0.05;
      image.Channel(2 - c)[i] = static_cast<float>(value) + noise * static_cast<float>((i * 29 + c * 5) % 17 - 8);
    }
  }
  return image;
}

TexelMask TwoOfThreeDiagonals() {
  TexelMask mask{kWidth, kHeight, {}};
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) mask.inside.push_back((x + y) % 3 != 0);
  }
  return mask;
}

Image StandardError() {
  Image image(kWidth, kHeight, {"Y"});
  for (int i = 0; i < kWidth * kHeight; ++i) image.data[i] = static_cast<float>(0.001 * (i % 7 + 1));
  return image;
}

TEST(Compare, FiguresAreThoseOfTheReferenceScript) {
  const Image reference = Pattern(0), candidate = Pattern(0.01f), a = Pattern(0.003f), b = Pattern(-0.002f);
  const Image standard_error = StandardError();
  const TexelMask mask = TwoOfThreeDiagonals();
  const absl::StatusOr<ErrorFigures> figures = CompareImages({&candidate, &reference, &mask, &a, &b, &standard_error});
  ASSERT_TRUE(figures.ok()) << figures.status();
  EXPECT_EQ(figures->texels, 32);
  EXPECT_EQ(figures->nonfinite, 0);
  EXPECT_NEAR(figures->mean_reference, 0.5811963099156505, kTolerance);
  EXPECT_NEAR(figures->mean_candidate, 0.5886096810906427, kTolerance);
  EXPECT_NEAR(figures->bias, 0.012755365181289549, kTolerance);
  EXPECT_NEAR(figures->rel_rmse, 0.0636871150757446, kTolerance);
  EXPECT_NEAR(figures->rel_mse, 0.009038923643577392, kTolerance);
  EXPECT_NEAR(figures->p50, 0.056831796388131635, kTolerance);
  EXPECT_NEAR(figures->p95, 0.2001493582829059, kTolerance);
  EXPECT_NEAR(figures->reference_noise.value(), 0.006801225376586348, kTolerance);
  EXPECT_NEAR(figures->rel_rmse_debiased.value(), 0.06332291812644149, kTolerance);
  EXPECT_NEAR(figures->rel_rmse_cross.value(), 0.05833299771393651, kTolerance);
}

TEST(Compare, AnImageEqualsItself) {
  const Image image = Pattern(0);
  const TexelMask mask = MaskFromCoverage(image);
  const absl::StatusOr<ErrorFigures> figures = CompareImages({&image, &image, &mask});
  ASSERT_TRUE(figures.ok());
  EXPECT_EQ(figures->texels, kWidth * kHeight);
  EXPECT_EQ(figures->rel_rmse, 0);
  EXPECT_EQ(figures->p95, 0);
  EXPECT_FALSE(figures->rel_rmse_cross.has_value());
  EXPECT_FALSE(figures->reference_noise.has_value());
}

TEST(Compare, ANanInTheMaskIsCountedAndSpoilsTheFiguresOutsideItDoesNot) {
  const Image reference = Pattern(0);
  Image candidate = Pattern(0.01f);
  TexelMask mask = TwoOfThreeDiagonals();
  candidate.Channel(0)[0] = std::numeric_limits<float>::quiet_NaN();  // (0, 0) is outside
  EXPECT_FALSE(std::isnan(CompareImages({&candidate, &reference, &mask})->rel_rmse));
  candidate.Channel(0)[1] = std::numeric_limits<float>::quiet_NaN();
  const absl::StatusOr<ErrorFigures> figures = CompareImages({&candidate, &reference, &mask});
  EXPECT_EQ(figures->nonfinite, 1);
  EXPECT_TRUE(std::isnan(figures->rel_rmse));
  EXPECT_TRUE(std::isnan(figures->p95));
}

TEST(Compare, InputsThatCannotBeComparedAreNamed) {
  const Image image = Pattern(0), small(4, 4, {"R", "G", "B"}), grey(kWidth, kHeight, {"Y"});
  const TexelMask mask = TwoOfThreeDiagonals(), nothing{kWidth, kHeight, std::vector<uint8_t>(kWidth * kHeight, 0)};
  const auto message = [](const Comparison& comparison) {
    const absl::Status status = CompareImages(comparison).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    return std::string(status.message());
  };
  EXPECT_EQ(message({&small, &image, &mask}), "sizes differ: the candidate is 4 x 4, the reference 8 x 6");
  EXPECT_EQ(message({&small, &small, &mask}), "sizes differ: the candidate is 4 x 4, the mask 8 x 6");
  EXPECT_EQ(message({&image, &grey, &mask}), "the reference has no channel R");
  EXPECT_EQ(message({&image, &image, &nothing}), "no texel is inside the mask");
  EXPECT_EQ(message({&image, &image, &mask, &image}), "one half of the reference without the other");
}

TEST(TexelMask, PictureIsCutAtTheGivenValue) {
  Image picture(3, 1, {"R"});
  picture.data = {0, 128.0f / 255, 1};
  EXPECT_EQ(MaskFromPicture(picture, 255)->inside, (std::vector<uint8_t>{0, 0, 1}));
  EXPECT_EQ(MaskFromPicture(picture, 128)->inside, (std::vector<uint8_t>{0, 1, 1}));
}

TEST(TexelMask, CoverageIsAlphaAboveZero) {
  Image image(3, 1, {"A", "R"});
  image.data = {0, 0.01f, 1, 5, 5, 5};
  EXPECT_EQ(MaskFromCoverage(image).inside, (std::vector<uint8_t>{0, 1, 1}));
}

TEST(TexelMask, TexelsThatSeeBackFacesAreTakenOut) {
  Image backface(3, 1, {"R"});
  backface.data = {0.019f, 0.021f, std::nanf("")};
  EXPECT_EQ(WithoutBackfaces({3, 1, {1, 1, 1}}, backface)->inside, (std::vector<uint8_t>{1, 0, 0}));
  EXPECT_FALSE(WithoutBackfaces({2, 1, {1, 1}}, backface).ok());
}

TEST(DrawDifference, BlueIsDarkerRedIsBrighterGreyIsOutside) {
  Image reference(5, 1, {"R", "G", "B"}), candidate = reference;
  for (int c = 0; c < 3; ++c) {
    for (int x = 0; x < 5; ++x) reference.At(c, x, 0) = 1;
    const float values[5] = {0, 1, 2, 7, std::nanf("")};
    for (int x = 0; x < 5; ++x) candidate.At(c, x, 0) = values[x];
  }
  const TexelMask mask{5, 1, {1, 1, 1, 0, 1}};
  const absl::StatusOr<DifferencePicture> picture = DrawDifference({&candidate, &reference, &mask});
  ASSERT_TRUE(picture.ok()) << picture.status();
  EXPECT_NEAR(picture->scale, 1, 1e-12);
  EXPECT_EQ(picture->rgb, (std::vector<uint8_t>{0, 0, 255, 255, 255, 255, 255, 0, 0, 128, 128, 128, 255, 0, 255}));
}

}  // namespace
}  // namespace bakewell
