#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace bakewell {

// The eight neighbours of a texel. Direction k + 4 is the opposite of k.
inline constexpr std::array<std::array<int, 2>, 8> kNeighbours = {
    {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};

// One texel of a noisy signal.
struct SmoothCell {
  float value = 0;
  float variance = 0;  // of value
  uint8_t open = 0;    // bit k: connected to neighbour k; mutual
  uint8_t room = 0;    // rings around it whose texels are all connected (SmoothGrid::MeasureRoom)
  uint8_t part = 0;    // connected texels have the same, most others do not
  bool known = false;  // value and variance are there
  float radius = 0;    // of the window that it would choose by itself
  float stray = 0;     // SmoothGrid::Calm
};

// What a grid's texels hold. Direct light has edges that its noise does not hide: the confidence intervals of its
// windows are narrower.
enum class Signal : uint8_t { kIndirect, kDirect };

// A rectangle of texels with a noisy signal, and how far around each texel it may be averaged.
//
// A texel's estimate is a first-order regression over the square window around it, as far as connected texels reach.
// The window grows as long as the confidence intervals of all its estimates so far intersect (Goldenshluger &
// Nemirovski 1997; Katkovnik 1999): where the signal bends more than the noise hides, or where there is no noise, the
// window stays at the texel itself.
class SmoothGrid {
 public:
  static constexpr int kMostRadius = 7;

  SmoothGrid(int width, int height, Signal signal)
      : signal_(signal),
        width_(width),
        height_(height),
        cells_(static_cast<size_t>(width) * static_cast<size_t>(height)) {}
  // The same texels and connections for another signal.
  SmoothGrid(SmoothGrid connected, Signal signal) : SmoothGrid(std::move(connected)) { signal_ = signal; }

  SmoothCell& At(int x, int y) { return cells_[Place(x, y)]; }
  const SmoothCell& At(int x, int y) const { return cells_[Place(x, y)]; }
  bool Contains(int x, int y) const { return x >= 0 && y >= 0 && x < width_ && y < height_; }
  int width() const { return width_; }
  int height() const { return height_; }

  // Connects (x, y) with its neighbour in direction k, if that lies on the grid.
  void Connect(int x, int y, int k);
  // After the last Connect: finds how far windows are squares, which need no search, and what cannot be in one window.
  void MeasureRoom();

  // The variance of a known texel as it and its neighbourhood say together: the mean over it and its connected
  // neighbours (eight blocks alone say little), but at most four times its own, so that a quiet texel beside a bright
  // one stays as it is; or what the texels within two stray from a plane, if that is less. Blocks of one Sobol set
  // overstate the error of the whole; texels' sets are independent, so that their strays do not.
  float NoiseVariance(int x, int y) const;

  // A known texel as windows are to be chosen by.
  struct Calm {
    float value = 0, variance = 0;
    float stray = 0;  // how far the value is from the neighbours' mean, in standard errors of that by all their blocks
  };
  // Its value with NoiseVariance; but the medians of its connected neighbours where it strays from them by far more
  // than their noise, and by no more than its own variance admits. One such stray would otherwise keep all windows
  // around it from growing, and itself from being averaged.
  Calm Calmed(int x, int y) const;
  // Once all are known: puts it in the texel's place.
  void Take(int x, int y, const Calm& calm);

  // The estimate of a window, and the variance that it will have once texels that are not known yet are as well known
  // as the others.
  struct Smoothed {
    float value = 0, variance = -1;  // negative: not computed
    float square = 1;                // sum of the squared weights
  };
  using Steps = std::array<Smoothed, kMostRadius + 1>;
  // The radius of the largest window whose estimate agrees with those of all smaller ones, between two whole ones where
  // the intervals part: it is continuous in the values. On the way there, the estimates by radius.
  float Choose(int x, int y, Steps* steps = nullptr) const;

  // The median of the radii of a texel and its neighbours (SmoothCell::radius): a texel that strays by more than its
  // interval, as some must, would otherwise keep to itself. One that strays farther than noise does (SmoothCell::stray)
  // keeps to itself: it is a detail. None goes farther than where wide intervals of its own part.
  float Agree(int x, int y) const;

  // What a window of `radius` gives; fills in the steps that it needs.
  Smoothed SmoothedAt(int x, int y, float radius, Steps& steps) const;

  // The estimate at the centre of a window is the sum of its values with these weights.
  struct Window {
    int radius = 0;
    std::array<float, (2 * kMostRadius + 1) * (2 * kMostRadius + 1)> weight{};  // rows of 2 kMostRadius + 1
    float At(int dx, int dy) const { return weight[Index(dx, dy)]; }
    static size_t Index(int dx, int dy) {
      return static_cast<size_t>((dy + kMostRadius) * (2 * kMostRadius + 1) + dx + kMostRadius);
    }
  };
  // Over known texels; between whole radii, the mix of the two windows.
  Window WindowOf(int x, int y, float radius) const;

 private:
  size_t Place(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
  }
  class Growth;
  // The largest radius, up to `most`, whose estimate agrees with those of all smaller ones: their intervals, of
  // `confidence` standard errors on either side, intersect.
  float Reach(int x, int y, double confidence, float most, Steps* steps) const;
  void NumberParts();
  float PooledVariance(int x, int y) const;
  void AddWeights(const Growth& growth, int x, int y, float share, Window& window) const;

  Signal signal_;
  int width_, height_;
  std::vector<SmoothCell> cells_;
};

}  // namespace bakewell
