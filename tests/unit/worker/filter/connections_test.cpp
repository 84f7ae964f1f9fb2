#include "worker/filter/connections.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/support/statistics.h"

namespace bakewell {
namespace {

constexpr int kSide = 48;

TEST(Connections, NothingIsReachedPastAWall) {
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
  EXPECT_TRUE(page.IsOpen(19, 20));
  EXPECT_EQ(page.Reach(19, 20).count(), kWindow);
  for (const int x : {20, 23, 24, 26}) {
    const WindowSet reached = page.Reach(x, 20);
    for (int dy = -kWindowRadius; dy <= kWindowRadius; ++dy) {
      for (int dx = -kWindowRadius; dx <= kWindowRadius; ++dx) {
        EXPECT_EQ(reached[WindowIndex(dx, dy)], (x + dx < 24) == (x < 24)) << x << " " << dx << " " << dy;
      }
    }
  }
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
    EXPECT_EQ(page.Reach(20, 20)[WindowIndex(0, -1)], end == 22);
    EXPECT_EQ(page.PartOf(20, 20), page.PartOf(20, 19));
  }
}

TEST(Connections, InOpenWindowsNothingIsCut) {
  Connections page(kSide, kSide);
  std::vector<bool> cut(kSide * kSide, false);
  TestRandom random(7);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      for (size_t k = 0; k < 4; ++k) {
        if (random.Unit() < 0.999f) {
          page.Connect(x, y, static_cast<int>(k));
          continue;
        }
        cut[static_cast<size_t>(y * kSide + x)] = true;
        const int nx = x + kNeighbours[k][0], ny = y + kNeighbours[k][1];
        if (page.Contains(nx, ny)) cut[static_cast<size_t>(ny * kSide + nx)] = true;
      }
    }
  }
  page.Finish();
  int open = 0;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      // A texel at the page's edge lacks connections too.
      bool whole = std::min({x, y, kSide - 1 - x, kSide - 1 - y}) >= kWindowRadius;
      for (int dy = 1 - kWindowRadius; whole && dy < kWindowRadius; ++dy) {
        for (int dx = 1 - kWindowRadius; dx < kWindowRadius; ++dx) {
          if (cut[static_cast<size_t>((y + dy) * kSide + x + dx)]) whole = false;
        }
      }
      EXPECT_EQ(page.IsOpen(x, y), whole) << x << " " << y;
      if (whole) {
        EXPECT_EQ(page.Reach(x, y).count(), kWindow);
      }
      open += whole ? 1 : 0;
    }
  }
  EXPECT_GT(open, kSide * kSide / 8);
}

TEST(Connections, WhatIsConnectedToNothingHasNoPart) {
  Connections page(3, 3);
  page.Connect(0, 0, 0);
  page.Finish();
  EXPECT_NE(page.PartOf(0, 0), 0);
  EXPECT_EQ(page.PartOf(1, 0), page.PartOf(0, 0));
  EXPECT_EQ(page.PartOf(1, 1), 0);
  EXPECT_EQ(page.Reach(1, 1).count(), 1U);
}

}  // namespace
}  // namespace bakewell
