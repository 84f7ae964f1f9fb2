#include "worker/filter/window.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "tests/support/statistics.h"

namespace bakewell {
namespace {

constexpr int kSide = 48;

// A page of connected texels that hold signal(x, y) and noise of a standard deviation, and what the filter makes of it.
class Page {
 public:
  Page(const std::function<float(int, int)>& value, float deviation, uint32_t seed, Signal signal = Signal::kIndirect)
      : signal_(value), deviation_(deviation), grid_(kSide, kSide, signal) {
    TestRandom random(seed);
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        SmoothCell& cell = grid_.At(x, y);
        cell.known = true;
        // The sum of twelve uniform numbers has variance 1.
        float normal = -6;
        for (int i = 0; i < 12; ++i) normal += random.Unit();
        cell.value = value(x, y) + deviation * normal;
        cell.variance = deviation * deviation;
        for (int k = 0; k < 4; ++k) grid_.Connect(x, y, k);
      }
    }
  }

  SmoothGrid& grid() { return grid_; }

  float Smoothed(int x, int y) const {
    const SmoothGrid::Window window = grid_.WindowOf(x, y, grid_.Agree(x, y));
    float sum = 0;
    for (int dy = -window.radius; dy <= window.radius; ++dy) {
      for (int dx = -window.radius; dx <= window.radius; ++dx) {
        if (window.At(dx, dy) != 0) sum += window.At(dx, dy) * value_[Place(x + dx, y + dy)];
      }
    }
    return sum;
  }

  // As the filters do.
  void Choose() {
    std::vector<SmoothGrid::Calm> calm(value_.size());
    ForEach([&](int x, int y) {
      value_[Place(x, y)] = grid_.At(x, y).value;
      calm[Place(x, y)] = grid_.Calmed(x, y);
    });
    ForEach([&](int x, int y) { grid_.Take(x, y, calm[Place(x, y)]); });
    ForEach([&](int x, int y) { grid_.At(x, y).radius = grid_.Choose(x, y); });
  }

  // Root mean square error after filtering over that before.
  double ErrorRatio() {
    Choose();
    double after = 0;
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        const double d = static_cast<double>(Smoothed(x, y) - signal_(x, y));
        after += d * d;
      }
    }
    return std::sqrt(after / (kSide * kSide)) / static_cast<double>(deviation_);
  }

 private:
  static size_t Place(int x, int y) { return static_cast<size_t>(y * kSide + x); }
  static void ForEach(const std::function<void(int, int)>& visit) {
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) visit(x, y);
    }
  }

  std::function<float(int, int)> signal_;
  float deviation_;
  SmoothGrid grid_;
  std::vector<float> value_ = std::vector<float>(kSide * kSide);  // before they were calmed
};

TEST(SmoothGrid, ASlopeIsKeptAndItsNoiseGoes) {
  const auto slope = [](int x, int y) { return 3 + 0.2f * static_cast<float>(x) - 0.1f * static_cast<float>(y); };
  // Intervals of half a standard error settle for windows of a dozen texels on the whole.
  EXPECT_LT(Page(slope, 0.5f, 1).ErrorRatio(), 0.4);
  EXPECT_LT(Page(slope, 0.01f, 1).ErrorRatio(), 0.4);
}

TEST(SmoothGrid, AnEdgeThatNoiseDoesNotHideStays) {
  const auto edge = [](int x, int) { return x < 20 ? 1.0f : 5.0f; };
  Page page(edge, 0.05f, 2);
  EXPECT_LT(page.ErrorRatio(), 0.6);
  for (int y = 0; y < kSide; ++y) {
    EXPECT_NEAR(page.Smoothed(19, y), 1, 0.25f) << y;
    EXPECT_NEAR(page.Smoothed(20, y), 5, 0.25f) << y;
  }
}

// Symptom: a sunlit texel above a strip of half shadow, none of which its own window took in, followed its neighbours'
// windows into it: some dozen texels of a page off by a fifth, which doubled the page's error at 256 samples.
TEST(SmoothGrid, DirectLightFollowsNeighboursOnlyAsFarAsItsOwnWindowsAgree) {
  const auto shadow = [](int x, int y) { return y < 20 ? 5.0f : x < 20 ? 4.0f : 2.0f; };
  Page page(shadow, 0.02f, 2, Signal::kDirect);
  for (int x = 20; x < kSide; ++x) {  // what lies below a wall
    page.grid().At(x, 19).open &= static_cast<uint8_t>(~0x0e);
    for (int dx = -1; dx <= 1; ++dx) {
      if (x + dx < kSide) page.grid().At(x + dx, 20).open &= static_cast<uint8_t>(~(1U << (6 - dx)));
    }
  }
  EXPECT_LT(page.ErrorRatio(), 0.9);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) EXPECT_NEAR(page.Smoothed(x, y), shadow(x, y), 0.15f) << x << " " << y;
  }
}

TEST(SmoothGrid, WithoutNoiseNothingChanges) {
  const auto bumps = [](int x, int y) {
    return 1 + std::sin(0.5f * static_cast<float>(x)) * std::cos(0.3f * static_cast<float>(y));
  };
  Page page(bumps, 0, 3);
  page.Choose();
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) EXPECT_EQ(page.Smoothed(x, y), bumps(x, y));
  }
}

TEST(SmoothGrid, NothingPassesWhereTexelsAreNotConnected) {
  // Two rooms, one on each side of a wall at x = 24; noise that would hide any difference.
  SmoothGrid grid(kSide, kSide, Signal::kIndirect);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      SmoothCell& cell = grid.At(x, y);
      cell.known = true;
      cell.value = x < 24 ? 0.0f : 1.0f;
      cell.variance = 100;
      for (int k = 0; k < 4; ++k) {
        if ((x + kNeighbours[static_cast<size_t>(k)][0] < 24) == (x < 24)) grid.Connect(x, y, k);
      }
    }
  }
  for (const int x : {22, 23, 24, 25}) {
    const SmoothGrid::Window window = grid.WindowOf(x, 20, SmoothGrid::kMostRadius);
    EXPECT_EQ(window.radius, SmoothGrid::kMostRadius);
    for (int dy = -7; dy <= 7; ++dy) {
      for (int dx = -7; dx <= 7; ++dx) {
        const bool other_room = (x + dx < 24) != (x < 24);
        EXPECT_TRUE(!other_room || window.At(dx, dy) == 0) << x << " " << dx;
      }
    }
  }
}

TEST(SmoothGrid, SquareWindowsAreWhatTheSearchFinds) {
  // Walls and holes at random; MeasureRoom only tells the search where it may be left out.
  SmoothGrid searched(kSide, kSide, Signal::kIndirect);
  TestRandom random(7);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      SmoothCell& cell = searched.At(x, y);
      cell.value = random.Unit();
      cell.variance = random.Unit();
      cell.known = random.Unit() < 0.97f;
      for (int k = 0; k < 4; ++k) {
        if (random.Unit() < 0.999f && (x / 20 == (x + kNeighbours[static_cast<size_t>(k)][0]) / 20))
          searched.Connect(x, y, k);
      }
    }
  }
  SmoothGrid measured = searched;
  measured.MeasureRoom();
  int squares = 0;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      if (!searched.At(x, y).known) continue;
      squares += measured.At(x, y).room >= 3 ? 1 : 0;
      const SmoothGrid::Window a = searched.WindowOf(x, y, 6.5f), b = measured.WindowOf(x, y, 6.5f);
      EXPECT_EQ(a.radius, b.radius);
      EXPECT_EQ(a.weight, b.weight) << x << " " << y;
      SmoothGrid::Steps steps_a, steps_b;
      const auto sa = searched.SmoothedAt(x, y, 6.5f, steps_a), sb = measured.SmoothedAt(x, y, 6.5f, steps_b);
      EXPECT_NEAR(sa.value, sb.value, 1e-6f);
      EXPECT_NEAR(sa.variance, sb.variance, 1e-6f);
      EXPECT_NEAR(searched.Choose(x, y), measured.Choose(x, y), 1e-4f);
    }
  }
  EXPECT_GT(squares, kSide * kSide / 8);
}

TEST(SmoothGrid, UnknownTexelsHaveNoWeightButCountAsIfTheyCame) {
  Page page([](int, int) { return 2.0f; }, 0.1f, 4);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 24; x < kSide; ++x) page.grid().At(x, y) = {.value = 1e9f, .open = page.grid().At(x, y).open};
  }
  const SmoothGrid::Window window = page.grid().WindowOf(23, 20, 5);
  for (int dy = -5; dy <= 5; ++dy) EXPECT_EQ(window.At(1, dy), 0);
  SmoothGrid::Steps steps;
  const auto smoothed = page.grid().SmoothedAt(23, 20, 5, steps);
  EXPECT_NEAR(smoothed.variance, 0.01f / 121, 1e-7f);
  EXPECT_NEAR(smoothed.value, 2, 0.1f);
}

TEST(SmoothGrid, AStrayTexelIsOutvoted) {
  Page page([](int, int) { return 1.0f; }, 0.1f, 5);
  page.grid().At(20, 20).value = 1.4f;  // four standard errors
  page.Choose();
  EXPECT_LT(page.grid().At(20, 20).radius, 1.0f);
  EXPECT_NEAR(page.Smoothed(20, 20), 1, 0.05f);
}

// Symptom: a dark texel in a corner among bright ones took its neighbours' window however little noise there was, which
// cost shelves of books (eight texels a metre) half their error at 2 %.
TEST(SmoothGrid, ADetailIsNotOutvoted) {
  Page page([](int, int) { return 1.0f; }, 0.03f, 5);
  page.grid().At(20, 20).value = 0.2f;  // 27 standard errors
  page.Choose();
  EXPECT_GT(page.grid().At(20, 20).stray, 20.0f);
  EXPECT_NEAR(page.Smoothed(20, 20), 0.2f, 0.04f);
}

// Symptom: of few samples, one in a few dozen texels met the bright doorway and said so itself (its blocks differ by
// all of it). Its quiet neighbours kept away from it, and it to itself: dim rooms were full of sparks.
TEST(SmoothGrid, SparksAreSpread) {
  Page page([](int, int) { return 1.0f; }, 0.1f, 5);
  int sparks = 0;
  for (int y = 3; y < kSide; y += 6) {
    for (int x = 3; x < kSide; x += 6, ++sparks) {
      page.grid().At(x, y).value += 4;
      page.grid().At(x, y).variance = 16;
    }
  }
  page.Choose();
  double sum = 0;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      EXPECT_LT(page.Smoothed(x, y), 2.0f) << x << " " << y;
      sum += static_cast<double>(page.Smoothed(x, y)) - 1;
    }
  }
  EXPECT_GT(sum, 2 * sparks);  // their light is not thrown away; the chart's sum is the page filter's to keep
}

}  // namespace
}  // namespace bakewell
