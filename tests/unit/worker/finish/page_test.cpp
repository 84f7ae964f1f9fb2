#include "worker/finish/page.h"

#include <gtest/gtest.h>

namespace bakewell {
namespace {

constexpr int kSide = 32;

// A page whose texels come from a picture: '.' nothing, a letter a valid texel of that chart, its capital an invalid
// one. Chart a has irradiance 1, chart b 5; invalid texels hold 99, which nobody may see.
struct Page {
  TexelMap map;
  std::vector<TexelLight> lights;

  explicit Page(const std::vector<std::string>& rows) {
    map.pages = {{kSide, kSide}};
    map.texel_at.emplace_back(kSide * kSide, -1);
    for (int y = 0; y < static_cast<int>(rows.size()); ++y) {
      for (int x = 0; x < static_cast<int>(rows[y].size()); ++x) {
        if (rows[y][x] != '.') Add(x, y, rows[y][x]);
      }
    }
  }

  void Add(int x, int y, char c) {
    Texel texel;
    texel.x = x;
    texel.y = y;
    texel.chart = std::tolower(c) - 'a';
    texel.coverage = 0.75f;
    map.texel_at[0][static_cast<size_t>(y * kSide + x)] = static_cast<int32_t>(map.texels.size());
    map.texels.push_back(texel);
    TexelLight light;
    light.valid = std::islower(c) != 0;
    const float value = !light.valid ? 99.0f : c == 'a' ? 1.0f : 5.0f;
    light.irradiance = {value, 2 * value, 3 * value};
    light.variance = {value / 8, 0, 0};
    light.sh.lambda[4] = {0, value, 0};
    lights.push_back(light);
  }
};

TEST(FinishPage, ValidTexelsAreUntouched) {
  const Page page({"", ".aab", ".aAb", ".abb"});
  const PageImages images = FinishPage(page.map, page.lights, 0);
  for (size_t i = 0; i < page.lights.size(); ++i) {
    if (!page.lights[i].valid) continue;
    const Texel& t = page.map.texels[i];
    for (int c = 0; c < 3; ++c) {
      EXPECT_EQ(images.irradiance.At(c, t.x, t.y), page.lights[i].irradiance[c]);
      EXPECT_EQ(images.variance.At(c, t.x, t.y), page.lights[i].variance[c]);
      EXPECT_EQ(images.sh.At(3 * 4 + c, t.x, t.y), page.lights[i].sh.lambda[4][c]);
    }
    EXPECT_EQ(images.irradiance.At(3, t.x, t.y), 0.75f);
  }
}

TEST(FinishPage, InvalidTexelsAreFilledFromTheirOwnChart) {
  const Page page({"", ".bbbbb", ".bAAab", ".bAAab", ".bbbbb"});
  const PageImages images = FinishPage(page.map, page.lights, 0);
  for (int y = 2; y <= 3; ++y) {
    for (int x = 2; x <= 3; ++x) {
      EXPECT_EQ(images.irradiance.At(0, x, y), 1) << x << " " << y;
      EXPECT_EQ(images.sh.At(3 * 4 + 1, x, y), 1);
    }
  }
}

TEST(FinishPage, InvalidTexelsOfAChartWithoutAnyValidOneGiveNothingAway) {
  // Nothing is known about this chart: it may take the gutter's value or zero, never what the invalid texel holds.
  const Page page({"", ".AA", ".AA"});
  const PageImages images = FinishPage(page.map, page.lights, 0);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      if (page.map.texel_at[0][static_cast<size_t>(y * kSide + x)] >= 0) continue;
      EXPECT_EQ(images.irradiance.At(0, x, y), 0);
    }
  }
}

TEST(FinishPage, GutterIsFilledAsWideAsPromisedAndNoWider) {
  std::vector<std::string> rows(16, std::string());
  rows.push_back(std::string(16, '.') + "b");  // one texel at (16, 16)
  const Page page(rows);
  const PageImages images = FinishPage(page.map, page.lights, 0);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const int rings = std::max(std::abs(x - 16), std::abs(y - 16));
      EXPECT_EQ(images.irradiance.At(0, x, y), rings <= kGutterTexels ? 5 : 0) << x << " " << y;
      EXPECT_EQ(images.irradiance.At(3, x, y), rings == 0 ? 0.75f : 0) << "coverage is not spread";
    }
  }
}

TEST(FinishPage, OtherPagesStayOut) {
  Page page({"", ".aa"});
  page.map.pages.push_back({4, 4});
  page.map.texel_at.emplace_back(16, -1);
  const PageImages images = FinishPage(page.map, page.lights, 1);
  EXPECT_EQ(images.irradiance.width, 4);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 4; ++x) EXPECT_EQ(images.irradiance.At(0, x, y), 0);
  }
}

}  // namespace
}  // namespace bakewell
