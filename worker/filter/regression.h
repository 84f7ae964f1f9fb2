#pragma once

namespace bakewell {

// Sums over a window's texels for a first-order regression over their offsets x, y [texels].
struct RegressionMoments {
  int n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  void Add(int dx, int dy, int count) {
    n += count;
    x += count * dx;
    y += count * dy;
    xx += count * dx * dx;
    xy += count * dx * dy;
    yy += count * dy * dy;
  }
  // The 8 r texels at Chebyshev distance r.
  void AddRing(int r) {
    const int squares = 2 * r * (r + 1) * (2 * r + 1) / 3 + 2 * (2 * r - 1) * r * r;
    n += 8 * r;
    xx += squares;
    yy += squares;
  }
};

// The regression's value at the window's centre is the sum of the values with weights constant + x dx + y dy.
struct RegressionWeights {
  double constant, x, y;

  // First row of the inverse of the normal equations.
  explicit RegressionWeights(const RegressionMoments& m) {
    if (m.x == 0 && m.y == 0) {
      constant = 1.0 / m.n;
      x = y = 0;
      return;
    }
    constexpr double kRidge = 1e-3;  // holds slopes back, so that texels in one line or one corner give an answer too
    const double xx = m.xx + kRidge * m.n, yy = m.yy + kRidge * m.n, xy = m.xy;
    const double c0 = xx * yy - xy * xy, c1 = xy * m.y - m.x * yy, c2 = m.x * xy - xx * m.y;
    const double det = m.n * c0 + m.x * c1 + m.y * c2;
    constant = c0 / det;
    x = c1 / det;
    y = c2 / det;
  }
  double At(int dx, int dy) const { return constant + x * dx + y * dy; }
  // Sum of the squared weights.
  double Square(const RegressionMoments& m) const {
    return constant * constant * m.n + x * x * m.xx + y * y * m.yy +
           2 * (constant * x * m.x + constant * y * m.y + x * y * m.xy);
  }
};

}  // namespace bakewell
