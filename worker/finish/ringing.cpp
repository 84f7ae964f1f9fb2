#include "worker/finish/ringing.h"

#include <immintrin.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace bakewell {
namespace {

// Eight texels side by side: what one gets does not depend on the others.
using Lanes = __m256;
static_assert(sizeof(Lanes) == kRingingLanes * sizeof(float));

Lanes Max(Lanes a, Lanes b) { return _mm256_max_ps(a, b); }
Lanes Min(Lanes a, Lanes b) { return _mm256_min_ps(a, b); }
Lanes Sqrt(Lanes a) { return _mm256_sqrt_ps(a); }
Lanes Abs(Lanes a) { return Max(a, -a); }

constexpr auto kMean = static_cast<float>(1 + kMostRinging);     // with what it may be below zero, over itself
constexpr auto kSpare = static_cast<float>(0.1 * kMostRinging);  // a search ends this near
constexpr float kLeastSlope = 1e-6f;  // half of b's components; without it poles would have no residue

double Factor(double strength, int l) { return 1 / (1 + strength * l * l * (l + 1) * (l + 1)); }

// Irradiance of one channel less its mean, over that: b . n + n^T q n for the normal n.
struct Quadratic {
  double b[3] = {}, diagonal[3] = {}, off[3] = {};  // off: yz, xz, xy

  Quadratic(const RadianceSh& sh, int channel) {
    const auto term = [&](int i, double basis) {
      return static_cast<double>(sh.lambda[static_cast<size_t>(i)][channel]) *
             static_cast<double>(kCosineLobe[static_cast<size_t>(i)]) * basis;
    };
    const double mean = term(0, 0.28209479);
    if (!(mean > 0)) return;
    const double over = 1 / mean, axial = over * term(6, 0.31539157), across = over * term(8, 0.54627422);
    for (int i = 0; i < 3; ++i) {
      constexpr int kBand1[] = {3, 1, 2}, kBand2[] = {5, 7, 4};
      b[i] = over * term(kBand1[i], 0.48860251);
      off[i] = over * term(kBand2[i], 0.5 * 1.09254843);
    }
    diagonal[0] = across - axial;
    diagonal[1] = -across - axial;
    diagonal[2] = 2 * axial;
  }

  // Not less than what it can be below zero: q has no trace, so that its least eigenvalue is not below -sqrt(2/3) of
  // its norm.
  double Depth() const {
    double band1 = 0, band2 = 0;
    for (int i = 0; i < 3; ++i) {
      band1 += b[i] * b[i];
      band2 += diagonal[i] * diagonal[i] + 2 * off[i] * off[i];
    }
    return std::sqrt(band1) + std::sqrt(2.0 / 3.0 * band2);
  }
};

// The same of eight texels, over what each has for a scale, in the frame of q's axes: windows change lengths only.
struct Channel {
  Lanes half_b[3], q[3];  // half_b: positive

  // The least b . n + ratio n^T q n over all normals. With a multiplier m for |n| = 1 the extrema are
  // n_i = -b_i / (2 (q_i - m)); the least has m <= q_min (the trust-region problem), where 1/|n| is concave in m:
  // Newton's method on 1/|n| = 1 goes one way from where the largest n_i is 1. Any m gives a lower bound.
  Lanes Least(Lanes ratio) const {
    const Lanes turned[3] = {ratio * q[0], ratio * q[1], ratio * q[2]};
    const Lanes low = Min(Min(turned[0], turned[1]), turned[2]);
    Lanes gap[3], below = {};  // q_i - q_min; q_min - m
    for (int i = 0; i < 3; ++i) {
      gap[i] = turned[i] - low;
      below = Max(below, half_b[i] - gap[i]);
    }
    for (int step = 0; step < 4; ++step) {
      Lanes square{}, slope{};
      for (int i = 0; i < 3; ++i) {
        const Lanes over = 1 / (gap[i] + below), n = half_b[i] * over;
        square += n * n;
        slope += n * n * over;
      }
      below += (Sqrt(square) - 1) * square / slope;
    }
    Lanes least = low - below;
    for (int i = 0; i < 3; ++i) least -= half_b[i] * half_b[i] / (gap[i] + below);
    return least;
  }
};

// One of Jacobi's rotations: makes a_ij zero. k is the third axis.
void Rotate(Lanes& a_ii, Lanes& a_jj, Lanes& a_ij, Lanes& a_ik, Lanes& a_jk, Lanes& b_i, Lanes& b_j) {
  const Lanes d = 0.5f * (a_jj - a_ii), size = Abs(d) + Sqrt(d * d + a_ij * a_ij) + 1e-30f;
  const Lanes t = a_ij / (d < 0 ? -size : size), c = 1 / Sqrt(1 + t * t), s = t * c;
  a_ii -= t * a_ij;
  a_jj += t * a_ij;
  a_ij = Lanes{};
  const auto turn = [&](Lanes& x, Lanes& y) {
    const Lanes before = x;
    x = c * x - s * y;
    y = s * before + c * y;
  };
  turn(a_ik, a_jk);
  turn(b_i, b_j);
}

void Diagonalize(Channel& channel, Lanes (&off)[3]) {
  auto& [b, q] = channel;
  for (int sweep = 0; sweep < 3; ++sweep) {
    Rotate(q[0], q[1], off[2], off[1], off[0], b[0], b[1]);
    Rotate(q[0], q[2], off[1], off[2], off[0], b[0], b[2]);
    Rotate(q[1], q[2], off[0], off[2], off[1], b[1], b[2]);
  }
  for (Lanes& one : b) one = Max(Abs(one), Lanes{} + kLeastSlope);
}

// Eight texels' irradiance under windows. They make b and q shorter by 1/w and 1/(9 w - 8), where w = 1 + 4 strength;
// searched is x = w / scale, where the scale is a w that does for certain: between 1 / scale and 1.
class Batch {
 public:
  explicit Batch(std::span<const RadianceSh* const> batch) {
    Lanes off[3][3] = {};
    for (size_t lane = 0; lane < batch.size(); ++lane) {
      const Quadratic channel[3] = {{*batch[lane], 0}, {*batch[lane], 1}, {*batch[lane], 2}};
      double& scale = scale_[lane];
      for (const Quadratic& one : channel) scale = std::max(scale, one.Depth() / double{kMean});
      const double over = std::isfinite(scale) ? 1 / scale : 0;
      for (int c = 0; c < 3; ++c) {
        for (int i = 0; i < 3; ++i) {
          channels_[c].half_b[i][lane] = static_cast<float>(0.5 * over * channel[c].b[i]);
          channels_[c].q[i][lane] = static_cast<float>(over * channel[c].diagonal[i]);
          off[c][i][lane] = static_cast<float>(over * channel[c].off[i]);
        }
      }
      least_[lane] = static_cast<float>(std::max(over, 1e-30));
    }
    for (int c = 0; c < 3; ++c) Diagonalize(channels_[c], off[c]);
  }

  Lanes least() const { return least_; }
  double StrengthAt(size_t lane, float x) const { return (scale_[lane] * static_cast<double>(x) - 1) / 4; }

  // w times what the least irradiance has above -kMostRinging of the mean, over the scale.
  Lanes Room(Lanes x) const {
    const Lanes ratio = 1 / (9 - 8 * least_ / x);
    return kMean * x + Min(Min(channels_[0].Least(ratio), channels_[1].Least(ratio)), channels_[2].Least(ratio));
  }

 private:
  Channel channels_[3] = {};
  Lanes least_ = Lanes{} + 1;
  std::array<double, kRingingLanes> scale_{1, 1, 1, 1, 1, 1, 1, 1};
};

}  // namespace

std::array<double, kRingingLanes> WindowStrengths(std::span<const RadianceSh* const> batch) {
  const Batch texels(batch);
  Lanes low = texels.least(), f_low = texels.Room(low), high = Lanes{} + 1, f_high = texels.Room(high);
  const auto rings = f_low < 0;
  // By the secant between one that rings and one that does not.
  for (int step = 0; step < 60; ++step) {
    const auto open = rings & (f_high > kSpare * high);
    if (_mm256_testz_ps((Lanes)open, (Lanes)open)) break;
    // Aims between the two ends of what is accepted; the midpoint now and then keeps it from creeping.
    const Lanes part = (0.5f * kSpare * high - f_low) / (f_high - f_low);
    const Lanes middle =
        low + (high - low) * (step % 4 == 3 ? Lanes{} + 0.5f : Min(Max(part, Lanes{} + 0.02f), Lanes{} + 0.98f));
    const Lanes f = texels.Room(middle);
    const auto below = open & (f < 0), above = open & (f >= 0);
    low = below ? middle : low;
    f_low = below ? f : f_low;
    high = above ? middle : high;
    f_high = above ? f : f_high;
  }
  std::array<double, kRingingLanes> strengths{};
  for (size_t lane = 0; lane < batch.size(); ++lane) {
    if (rings[lane]) strengths[lane] = texels.StrengthAt(lane, high[lane]);
  }
  return strengths;
}

RadianceSh Windowed(const RadianceSh& sh, double strength) {
  RadianceSh result = sh;
  if (strength == 0) return result;
  for (int l = 1; l <= 2; ++l) {
    const auto factor = static_cast<float>(Factor(strength, l));
    for (int i = l * l; i < (l + 1) * (l + 1); ++i)
      result.lambda[static_cast<size_t>(i)] = sh.lambda[static_cast<size_t>(i)] * factor;
  }
  return result;
}

}  // namespace bakewell
