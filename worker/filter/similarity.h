#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "worker/filter/connections.h"

namespace bakewell {

// Texels whose squared differences are on the mean as large as their variances count in full; where they are larger by
// kTolerance squared of that, for 1 / e.
inline constexpr float kTolerance = 0.9f;
// Weight by the mean of squared differences over their variances: exp(-(ratio - 1) / kTolerance^2), but for what is
// next to nothing. T: float, or several side by side.
template <typename T>
T Likeness(T ratio) {
  const T beyond = ratio - 1, fall = (beyond > 0 ? beyond : T{}) * (1 / (8 * kTolerance * kTolerance));
  const T left = 1 - fall, root = left > 0 ? left : T{};
  const T root2 = root * root, root4 = root2 * root2;
  return root4 * root4;
}
// Weight by the square of the distance [texels].
inline constexpr float kDeviation = 2.5f;
inline float Nearness(float distance_square) { return std::exp(distance_square / (-2 * kDeviation * kDeviation)); }

// The weights that a block of texels with a noisy signal is averaged with: non-local means (Buades et al. 2005), by how
// far texels differ beyond their noise (Rousselle et al. 2012). Two texels are alike where the 3 x 3 texels around the
// one and around the other differ by no more than their variances say; nearer ones count for more. A regression over
// the texels that count takes off half of what a slope adds at the border of a chart.
class SimilarTexels {
 public:
  static constexpr int kHalo = kWindowRadius + 2;  // texels around the block that its weights depend on

  // A block of width x height texels without values.
  SimilarTexels(int width, int height);

  void Clear();
  // A value and its variance at (x, y), -kHalo <= x < width + kHalo, likewise y. part: Connections::PartOf; of texels
  // without one nothing is known.
  void Put(int x, int y, float value, float variance, uint16_t part);

  // After the last Put. around: there are values around the block.
  void Compare(bool around);
  // Takes their weight in texel (x, y) of the block from those that are cut off.
  void CutOff(int x, int y, const WindowSet& cut);
  // Makes the weights of each texel add up to one. margin: by how much the variances that were put are too large.
  void Regress(float margin = 1);

  // Of texel (x + dx, y + dy) in the mean of texel (x, y) of the block. After Regress.
  float Weight(int x, int y, int dx, int dy) const {
    return weights_[WindowIndex(dx, dy) * plane_ + static_cast<size_t>(y) * row_ + static_cast<size_t>(x)];
  }
  // What a window's texels count for by their distance alone.
  static float Nearness(int dx, int dy);

  // The mean of a texel's window, and how good it is by Stein's estimate (Van De Ville & Kocher 2009): weights that are
  // chosen by noisy values follow their noise.
  struct Mean {
    float value = 0;
    float follows = 1;      // derivative by the texel's own value; its weight, and more
    float square = 0;       // of the derivatives by all values, sum of the squares
    float variance = 0;     // likewise, times the variances pooled over 3 x 3
    float bias_square = 0;  // of the error what noise does not explain; for one texel a guess, and may be negative
  };
  // After Regress.
  const Mean& MeanOf(int x, int y) const { return means_[static_cast<size_t>(y) * row_ + static_cast<size_t>(x)]; }

 private:
  size_t Place(int x, int y) const { return static_cast<size_t>(y + kHalo) * stride_ + static_cast<size_t>(x + kHalo); }
  void PoolVariances();
  void Average(int y, float margin);
  void CompareAt(int dx, int dy, bool around);
  // Of texels (x, y) and (x + dx, y + dy) and those to their left and right: the sum of the squared differences over
  // their variances, and how many there are. Element x - first, x from `first` up to `end`.
  void Differences(int y, int dx, int dy, int first, int end, float* squares, float* counts) const;

  int width_, height_;
  size_t stride_;       // of what is put
  size_t row_, plane_;  // of weights; rows of whole lanes
  std::vector<float> value_, variance_, pooled_;
  std::vector<int32_t> part_;
  std::vector<float> weights_;  // kWindow planes
  std::vector<Mean> means_;     // a plane
};

}  // namespace bakewell
