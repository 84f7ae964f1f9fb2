#include "core/image/exr.h"

#include <gtest/gtest.h>

#include <bit>
#include <limits>

#include "core/artifact/atomic_file.h"
#include "tests/support/temp_dir.h"

namespace bakewell {
namespace {

std::vector<std::string> ShNames() {
  std::vector<std::string> names;
  for (int i = 0; i < 9; ++i) {
    for (const char* const rgb : {"B", "G", "R"}) names.push_back("sh" + std::to_string(i) + "." + rgb);
  }
  return names;
}

Image Ramp(int width, int height, std::vector<std::string> names) {
  Image image(width, height, std::move(names));
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = 0.37f * static_cast<float>(i % 1013) - 20.0f;
  return image;
}

void ExpectSameBits(const std::vector<float>& a, const std::vector<float>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) ASSERT_EQ(std::bit_cast<uint32_t>(a[i]), std::bit_cast<uint32_t>(b[i])) << i;
}

TEST(Exr, TwentySevenNamedChannelsComeBackBitForBit) {
  const TempDir folder;
  const Image written = Ramp(33, 21, ShNames());
  ASSERT_TRUE(WriteExr(folder / "a.exr", written).ok());
  const absl::StatusOr<Image> read = ReadExr(folder / "a.exr");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->width, 33);
  EXPECT_EQ(read->height, 21);
  EXPECT_EQ(read->channels, written.channels);
  ExpectSameBits(read->data, written.data);
}

TEST(Exr, ChannelsAreReadInAlphabeticalOrder) {
  const TempDir folder;
  Image written(1, 1, {"R", "G", "B", "A"});
  written.data = {1, 2, 3, 4};
  ASSERT_TRUE(WriteExr(folder / "a.exr", written).ok());
  const absl::StatusOr<Image> read = ReadExr(folder / "a.exr");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->channels, (std::vector<std::string>{"A", "B", "G", "R"}));
  EXPECT_EQ(read->data, (std::vector<float>{4, 3, 2, 1}));
}

TEST(Exr, NanInfinityZeroSignAndDenormalsSurvive) {
  using Limits = std::numeric_limits<float>;
  const TempDir folder;
  Image written(8, 1, {"Y"});
  written.data = {Limits::quiet_NaN(),
                  Limits::infinity(),
                  -Limits::infinity(),
                  Limits::denorm_min(),
                  -0.0f,
                  Limits::max(),
                  Limits::lowest(),
                  std::bit_cast<float>(0x7fc12345u)};
  ASSERT_TRUE(WriteExr(folder / "a.exr", written).ok());
  const absl::StatusOr<Image> read = ReadExr(folder / "a.exr");
  ASSERT_TRUE(read.ok()) << read.status();
  ExpectSameBits(read->data, written.data);
}

TEST(Exr, SameImageGivesSameBytes) {
  const TempDir folder;
  const Image image = Ramp(70, 40, ShNames());
  ASSERT_TRUE(WriteExr(folder / "a.exr", image).ok());
  ASSERT_TRUE(WriteExr(folder / "b.exr", image).ok());
  EXPECT_EQ(ReadWholeFile(folder / "a.exr").value(), ReadWholeFile(folder / "b.exr").value());
}

TEST(Exr, EveryTruncationIsAnErrorThatNamesTheFile) {
  const TempDir folder;
  ASSERT_TRUE(WriteExr(folder / "a.exr", Ramp(20, 40, {"R", "G", "B"})).ok());
  const std::string bytes = ReadWholeFile(folder / "a.exr").value();
  for (size_t size = 0; size < bytes.size(); ++size) {
    WriteQuickly(folder / "cut.exr", std::string_view(bytes).substr(0, size));
    const absl::StatusOr<Image> read = ReadExr(folder / "cut.exr");
    ASSERT_EQ(read.status().code(), absl::StatusCode::kInvalidArgument) << size << " of " << bytes.size() << " bytes";
    ASSERT_NE(std::string(read.status().message()).find("cut.exr"), std::string::npos);
  }
}

TEST(Exr, AFlippedByteIsAnErrorOrAnImageNeverACrash) {
  const TempDir folder;
  ASSERT_TRUE(WriteExr(folder / "a.exr", Ramp(20, 40, {"R", "G", "B"})).ok());
  const std::string bytes = ReadWholeFile(folder / "a.exr").value();
  for (size_t i = 0; i < bytes.size(); ++i) {
    std::string hostile = bytes;
    hostile[i] = static_cast<char>(hostile[i] ^ 0xff);
    WriteQuickly(folder / "bad.exr", hostile);
    const absl::StatusOr<Image> read = ReadExr(folder / "bad.exr");
    ASSERT_TRUE(read.ok() || read.status().code() == absl::StatusCode::kInvalidArgument) << read.status();
  }
}

TEST(Exr, MissingFileIsNotFound) {
  EXPECT_EQ(ReadExr("/nonexistent/a.exr").status().code(), absl::StatusCode::kNotFound);
}

TEST(Exr, ImagesThatTheFormatCannotHoldAreRefused) {
  const TempDir folder;
  EXPECT_EQ(WriteExr(folder / "a.exr", Image()).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(WriteExr(folder / "a.exr", Image(2, 2, {})).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(WriteExr(folder / "a.exr", Image(2, 2, {"R", "R"})).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_FALSE(std::filesystem::exists(folder / "a.exr"));
}

}  // namespace
}  // namespace bakewell
