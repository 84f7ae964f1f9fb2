#include "core/image/png.h"

#include <gtest/gtest.h>

#include "core/artifact/atomic_file.h"
#include "tests/support/temp_dir.h"

namespace bakewell {
namespace {

std::vector<uint8_t> Ramp(int width, int height) {
  std::vector<uint8_t> rgb(static_cast<size_t>(3 * width * height));
  for (size_t i = 0; i < rgb.size(); ++i) rgb[i] = static_cast<uint8_t>(i * 7);
  return rgb;
}

TEST(Png, EveryByteComesBack) {
  const TempDir folder;
  const std::vector<uint8_t> rgb = Ramp(19, 11);
  ASSERT_TRUE(WritePng(folder / "a.png", 19, 11, rgb).ok());
  const absl::StatusOr<Image> read = ReadPng(folder / "a.png");
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->width, 19);
  ASSERT_EQ(read->height, 11);
  EXPECT_EQ(read->channels, (std::vector<std::string>{"R", "G", "B", "A"}));
  for (size_t i = 0; i < read->PixelCount(); ++i) {
    for (int c = 0; c < 3; ++c) ASSERT_EQ(read->Channel(c)[i] * 255, rgb[3 * i + static_cast<size_t>(c)]);
    ASSERT_EQ(read->Channel(3)[i], 1);
  }
}

TEST(Png, SamePixelsGiveSameBytes) {
  const TempDir folder;
  ASSERT_TRUE(WritePng(folder / "a.png", 19, 11, Ramp(19, 11)).ok());
  ASSERT_TRUE(WritePng(folder / "b.png", 19, 11, Ramp(19, 11)).ok());
  EXPECT_EQ(ReadWholeFile(folder / "a.png").value(), ReadWholeFile(folder / "b.png").value());
}

// A 4 x 1 grey PNG of 2 bits a pixel, 0 1 2 3, with a gAMA chunk of 1.0, made by hand.
TEST(Png, GreyOfTwoBitsIsScaledAndNotGammaCorrected) {
  const unsigned char bytes[] = {
      0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44, 0x52, 0x00, 0x00,
      0x00, 0x04, 0x00, 0x00, 0x00, 0x01, 0x02, 0x00, 0x00, 0x00, 0x00, 0x96, 0xe7, 0x48, 0xb0, 0x00, 0x00, 0x00,
      0x04, 0x67, 0x41, 0x4d, 0x41, 0x00, 0x01, 0x86, 0xa0, 0x31, 0xe8, 0x96, 0x5f, 0x00, 0x00, 0x00, 0x0d, 0x49,
      0x44, 0x41, 0x54, 0x78, 0x01, 0x01, 0x02, 0x00, 0xfd, 0xff, 0x00, 0x1b, 0x00, 0x1d, 0x00, 0x1c, 0x1d, 0x49,
      0x23, 0xd5, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};
  const TempDir folder;
  ASSERT_TRUE(WriteFileAtomically(folder / "a.png", std::as_bytes(std::span(bytes))).ok());
  const absl::StatusOr<Image> read = ReadPng(folder / "a.png");
  ASSERT_TRUE(read.ok()) << read.status();
  for (int x = 0; x < 4; ++x) EXPECT_FLOAT_EQ(read->At(0, x, 0), static_cast<float>(x) / 3);
}

TEST(Png, EveryTruncationIsAnErrorThatNamesTheFile) {
  const TempDir folder;
  ASSERT_TRUE(WritePng(folder / "a.png", 19, 11, Ramp(19, 11)).ok());
  const std::string bytes = ReadWholeFile(folder / "a.png").value();
  for (size_t size = 0; size < bytes.size(); ++size) {
    WriteQuickly(folder / "cut.png", std::string_view(bytes).substr(0, size));
    const absl::StatusOr<Image> read = ReadPng(folder / "cut.png");
    ASSERT_EQ(read.status().code(), absl::StatusCode::kInvalidArgument) << size << " of " << bytes.size() << " bytes";
    ASSERT_NE(std::string(read.status().message()).find("cut.png"), std::string::npos);
  }
}

TEST(Png, AFlippedByteIsAnErrorOrAnImageNeverACrash) {
  const TempDir folder;
  ASSERT_TRUE(WritePng(folder / "a.png", 19, 11, Ramp(19, 11)).ok());
  const std::string bytes = ReadWholeFile(folder / "a.png").value();
  for (size_t i = 0; i < bytes.size(); ++i) {
    std::string hostile = bytes;
    hostile[i] = static_cast<char>(hostile[i] ^ 0xff);
    WriteQuickly(folder / "bad.png", hostile);
    const absl::StatusOr<Image> read = ReadPng(folder / "bad.png");
    ASSERT_TRUE(read.ok() || read.status().code() == absl::StatusCode::kInvalidArgument) << read.status();
  }
}

TEST(TonemapPreview, NinetyFifthPercentileOfCoveredPixelsIsShownAtFourFifths) {
  Image image(100, 2, {"R", "G", "B", "A"});
  for (int x = 0; x < 100; ++x) {
    for (int c = 0; c < 3; ++c) {
      image.At(c, x, 0) = static_cast<float>(x + 1);
      image.At(c, x, 1) = 1e6f;  // uncovered: must not count
    }
    image.At(3, x, 0) = 1;
  }
  const std::vector<uint8_t> rgb = TonemapPreview(image);
  // x = 94 holds 95; linear 0.8 is 231 in sRGB; rounding of the exposure may move it by one.
  EXPECT_NEAR(rgb[3 * 94], 231, 1);
  EXPECT_GT(rgb[3 * 99], rgb[3 * 94]);
  EXPECT_EQ(rgb[3 * 100], 255);
}

TEST(TonemapPreview, ANanPixelIsBlack) {
  Image image(1, 1, {"R", "G", "B"});
  image.data = {std::nanf(""), 1, 1};
  EXPECT_EQ(TonemapPreview(image)[0], 0);
}

}  // namespace
}  // namespace bakewell
