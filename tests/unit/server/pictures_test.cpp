#include "server/preview/pictures.h"

#include <gtest/gtest.h>

#include "core/artifact/atomic_file.h"
#include "core/image/png.h"
#include "tests/support/temp_dir.h"

namespace bakewell::preview {
namespace {

Image Shown(const Canvas& canvas) {
  const TempDir dir;
  EXPECT_TRUE(WriteFileAtomically(dir / "a.png", canvas.Png().value()).ok());
  return ReadPng(dir / "a.png").value();
}

TEST(Canvas, FillsInWhereItsPartsLie) {
  Canvas canvas;
  EXPECT_EQ(canvas.Png().status().code(), absl::StatusCode::kNotFound);
  ASSERT_TRUE(canvas.Add({4, 2, {{0, 0, {1, 1, 1}}}}).ok());
  Image picture = Shown(canvas);
  ASSERT_EQ(picture.width, 4);
  ASSERT_EQ(picture.height, 2);
  EXPECT_GT(picture.At(0, 0, 0), 0.5f);
  EXPECT_EQ(picture.At(0, 3, 1), 0);
  ASSERT_TRUE(canvas.Add({4, 2, {{3, 1, {1, 0, 0}}}}).ok());
  picture = Shown(canvas);
  EXPECT_GT(picture.At(0, 3, 1), 0.5f);
  EXPECT_EQ(picture.At(1, 3, 1), 0);
  // The same part once more (its task was done twice) changes nothing.
  ASSERT_TRUE(canvas.Add({4, 2, {{3, 1, {1, 0, 0}}}}).ok());
  EXPECT_EQ(Shown(canvas).data, picture.data);
}

TEST(Canvas, LargestPageMakesASmallPicture) {
  Canvas canvas;
  ASSERT_TRUE(canvas.Add({65535, 300, {{65534, 299, {1, 1, 1}}}}).ok());
  const Image picture = Shown(canvas);
  EXPECT_LE(picture.width, Canvas::kMaxSide);
  EXPECT_GE(picture.height, 1);
  EXPECT_GT(picture.At(0, picture.width - 1, picture.height - 1), 0.5f);
}

TEST(Canvas, PartOfAnotherPageIsRefused) {
  Canvas canvas;
  ASSERT_TRUE(canvas.Add({4, 2, {}}).ok());
  EXPECT_FALSE(canvas.Add({2, 4, {{0, 0, {1, 1, 1}}}}).ok());
}

}  // namespace
}  // namespace bakewell::preview
