#include "worker/filter/connections.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <vector>

#include "tests/support/statistics.h"

namespace bakewell {
namespace {

constexpr int kSide = 80;  // more than the bits of a word

TEST(Connections, RoomsAreApart) {
  // Two rooms, one on each side of a wall at x = 24.
  Connections page(kSide, kSide);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      for (int k = 0; k < 4; ++k) {
        if ((x + kNeighbours[static_cast<size_t>(k)][0] < 24) == (x < 24)) page.Connect(x, y, k);
      }
    }
  }
  page.Finish();
  EXPECT_NE(page.PartOf(23, 20), page.PartOf(24, 20));
  EXPECT_EQ(page.PartOf(23, 20), page.PartOf(0, 47));
  for (const int x : {19, 20, 23, 24, 26}) EXPECT_TRUE(page.CutOff(x, 20).none()) << x;
}

TEST(Connections, ItIsReachedAroundAWallThatEndsInTheWindowAndNotOutside) {
  for (const int end : {22, 26}) {  // a wall between rows 19 and 20, from the left as far as x = end
    Connections page(kSide, kSide);
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        for (size_t k = 0; k < 4; ++k) {
          const int ny = y + kNeighbours[k][1], nx = x + kNeighbours[k][0];
          if ((y < 20) == (ny < 20) || (x > end && nx > end)) page.Connect(x, y, static_cast<int>(k));
        }
      }
    }
    page.Finish();
    EXPECT_EQ(page.PartOf(20, 20), page.PartOf(20, 19));
    const WindowSet cut = page.CutOff(20, 20);
    for (int dy = -kWindowRadius; dy <= kWindowRadius; ++dy) {
      for (int dx = -kWindowRadius; dx <= kWindowRadius; ++dx) {
        EXPECT_EQ(cut[WindowIndex(dx, dy)], end == 26 && dy < 0) << dx << " " << dy;
      }
    }
  }
}

// What is cut off on a page whose texels are connected where `connected` says, against a search that knows nothing but
// that; how much it is.
int CheckCutOff(const std::function<bool(int, int, int, int)>& connected) {
  Connections page(kSide, kSide);
  std::vector<uint8_t> open(kSide * kSide, 0);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      for (size_t k = 0; k < 4; ++k) {
        const int nx = x + kNeighbours[k][0], ny = y + kNeighbours[k][1];
        if (!page.Contains(nx, ny) || !connected(x, y, nx, ny)) continue;
        page.Connect(x, y, static_cast<int>(k));
        open[static_cast<size_t>(y * kSide + x)] |= static_cast<uint8_t>(1U << k);
        open[static_cast<size_t>(ny * kSide + nx)] |= static_cast<uint8_t>(1U << (k + 4));
      }
    }
  }
  page.Finish();
  int cut_off = 0;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      WindowSet found;
      found[WindowIndex(0, 0)] = true;
      for (size_t before = 0; before != found.count();) {
        before = found.count();
        for (int dy = -kWindowRadius; dy <= kWindowRadius; ++dy) {
          for (int dx = -kWindowRadius; dx <= kWindowRadius; ++dx) {
            if (!found[WindowIndex(dx, dy)]) continue;
            for (size_t k = 0; k < kNeighbours.size(); ++k) {
              const int nx = dx + kNeighbours[k][0], ny = dy + kNeighbours[k][1];
              if (!(open[static_cast<size_t>((y + dy) * kSide + x + dx)] >> k & 1)) continue;
              if (std::max(std::abs(nx), std::abs(ny)) <= kWindowRadius) found[WindowIndex(nx, ny)] = true;
            }
          }
        }
      }
      const WindowSet cut = page.CutOff(x, y);
      cut_off += static_cast<int>(cut.count());
      for (int dy = -kWindowRadius; dy <= kWindowRadius; ++dy) {
        for (int dx = -kWindowRadius; dx <= kWindowRadius; ++dx) {
          const bool same = page.Contains(x + dx, y + dy) && page.PartOf(x, y) != 0 &&
                            page.PartOf(x + dx, y + dy) == page.PartOf(x, y);
          EXPECT_EQ(same && !cut[WindowIndex(dx, dy)], same && found[WindowIndex(dx, dy)]) << x << " " << y;
          EXPECT_TRUE(same || !found[WindowIndex(dx, dy)] || (dx == 0 && dy == 0));
        }
      }
    }
  }
  return cut_off;
}

TEST(Connections, WhatIsCutOffIsWhatASearchDoesNotFind) {
  // Rooms with doors and pillars, and cuts at random.
  TestRandom random(7);
  const auto pillar = [](int x, int y) { return x % 7 == 3 && y % 9 == 4; };
  const int in_rooms = CheckCutOff([&](int x, int y, int nx, int ny) {
    if (pillar(x, y) || pillar(nx, ny)) return false;
    if (x / 16 != nx / 16 && (y % 16 < 6 || ny % 16 < 6)) return false;
    return random.Unit() >= 0.002f;
  });
  EXPECT_GT(in_rooms, 100);
  // Charts that are rectangles and slanted strips.
  EXPECT_EQ(CheckCutOff([](int x, int y, int nx, int ny) { return x / 9 == nx / 9 && y / 5 == ny / 5; }), 0);
  EXPECT_EQ(CheckCutOff([](int x, int y, int nx, int ny) { return (x + 2 * y) / 7 == (nx + 2 * ny) / 7; }), 0);
  // A comb.
  const auto comb = [](int x, int y, int nx, int ny) { return x / 2 == nx / 2 || std::max(y, ny) < 2; };
  EXPECT_GT(CheckCutOff(comb), 1000);
  // So few connections that every direction matters.
  EXPECT_GT(CheckCutOff([&](int, int, int, int) { return random.Unit() < 0.35f; }), 1000);
}

TEST(Connections, WhatIsConnectedToNothingHasNoPart) {
  Connections page(3, 3);
  page.Connect(0, 0, 0);
  page.Finish();
  EXPECT_NE(page.PartOf(0, 0), 0);
  EXPECT_EQ(page.PartOf(1, 0), page.PartOf(0, 0));
  EXPECT_EQ(page.PartOf(1, 1), 0);
}

}  // namespace
}  // namespace bakewell
