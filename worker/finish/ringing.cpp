#include "worker/finish/ringing.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

namespace bakewell {
namespace {

constexpr double kAim = 0.9 * kMostRinging;  // between this and kMostRinging a search ends

double Factor(double strength, int l) { return 1 / (1 + strength * l * l * (l + 1) * (l + 1)); }

// Irradiance of one channel, over its mean, as a polynomial of the normal, 1 + b . n + n^T q n, in the frame of q's
// axes: windows change the lengths of b and q only.
class Quadratic {
 public:
  Quadratic(const RadianceSh& sh, int channel) {
    const auto term = [&](int i, double basis) {
      return static_cast<double>(sh.lambda[static_cast<size_t>(i)][channel]) *
             static_cast<double>(kCosineLobe[static_cast<size_t>(i)]) * basis;
    };
    mean_ = term(0, 0.28209479);
    if (!(mean_ > 0)) return;
    const double axial = term(6, 0.31539157), across = term(8, 0.54627422);
    const double xy = 0.5 * term(4, 1.09254843), yz = 0.5 * term(5, 1.09254843), xz = 0.5 * term(7, 1.09254843);
    q_ << across - axial, xy, xz, xy, -across - axial, yz, xz, yz, 2 * axial;
    b_ << term(3, 0.48860251), term(1, 0.48860251), term(2, 0.48860251);
    q_ /= mean_;
    b_ /= mean_;
    // q has no trace: its least eigenvalue is not below -sqrt(2/3) of its norm.
    may_ring_ = 1 - b_.norm() - std::sqrt(2.0 / 3.0) * q_.norm() < -kMostRinging;
    if (!may_ring_) return;
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes;
    axes.computeDirect(q_);
    eigenvalues_ = axes.eigenvalues();
    b_ = axes.eigenvectors().transpose() * b_;
  }

  // The least irradiance over all normals, over the mean, with the window of this strength. With a multiplier m for
  // |n| = 1 the extrema are n_i = -b_i / (2 (q_i - m)); the least has m <= q_min (the trust-region problem).
  double Least(double strength) const {
    if (!may_ring_) return 1;
    const Eigen::Vector3d q = Factor(strength, 2) * eigenvalues_, b = Factor(strength, 1) * b_;
    double m = q[0] - 0.5 * b.norm();  // here |n| <= 1
    for (int step = 0; step < 40; ++step) {
      double square = 0, slope = 0;
      for (int i = 0; i < 3; ++i) {
        const double gap = std::max(q[i] - m, 1e-14), n = 0.5 * b[i] / gap;
        square += n * n;
        slope += n * n / gap;
      }
      if (!(square > 0)) break;
      // Newton's method on 1/|n| = 1, from below; halfway to the pole where it would jump over that.
      const double length = std::sqrt(square), next = m + (1 / length - 1) * square * length / slope;
      const double step_to = next < q[0] ? next : 0.5 * (m + q[0]);
      if (std::fabs(step_to - m) < 1e-5) break;
      m = step_to;
    }
    double along = 0;
    for (int i = 0; i < 3; ++i) along += 0.25 * b[i] * b[i] / std::max(q[i] - m, 1e-14);
    return 1 + m - along;
  }

 private:
  double mean_ = 0;
  bool may_ring_ = false;
  Eigen::Matrix3d q_;
  Eigen::Vector3d b_, eigenvalues_;
};

// A strength at which `room` is just above zero: it is below at 0 and above at infinity.
template <typename Room>
double Search(Room room) {
  double low = 0, f_low = room(0), high = 0.02, f_high = 0;
  for (; (f_high = room(high)) < 0; high *= 4) {
    low = high;
    f_low = f_high;
  }
  // By the secant between one that rings and one that does not.
  for (int step = 0; step < 60 && f_high > kMostRinging - kAim; ++step) {
    // Aims between the two ends of what is accepted; the midpoint now and then keeps it from creeping.
    const double aim = 0.5 * (kMostRinging - kAim), part = (aim - f_low) / (f_high - f_low);
    const double middle = low + (high - low) * (step % 4 == 3 ? 0.5 : std::clamp(part, 0.02, 0.98));
    const double f = room(middle);
    (f < 0 ? low : high) = middle;
    (f < 0 ? f_low : f_high) = f;
  }
  return high;
}

}  // namespace

double WindowStrength(const RadianceSh& sh) {
  const std::array<Quadratic, 3> channels = {Quadratic(sh, 0), Quadratic(sh, 1), Quadratic(sh, 2)};
  const std::array<double, 3> least = {channels[0].Least(0), channels[1].Least(0), channels[2].Least(0)};
  const auto worst = static_cast<size_t>(std::min_element(least.begin(), least.end()) - least.begin());
  if (least[worst] >= -kMostRinging) return 0;
  // The window that the worst channel needs does for the others, nearly always.
  const double strength = Search([&](double s) { return channels[worst].Least(s) + kMostRinging; });
  const auto all = [&](double s) {
    double room = 1;
    for (const Quadratic& channel : channels) room = std::min(room, channel.Least(s) + kMostRinging);
    return room;
  };
  return all(strength) >= 0 ? strength : Search(all);
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
