#include "worker/filter/window.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bakewell {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr float kLift = 0.05f;       // height of the rays between neighbours, over their length
constexpr float kSameFacing = 0.9f;  // least cosine between the normals of neighbours
constexpr double kConfidence = 0.5;  // half width of a confidence interval, in standard errors
constexpr float kMostOverOwn = 4;    // times a texel's own variance that its neighbours may make of it
constexpr int kStrayRadius = 2;      // of the window whose strays say how large the noise is
constexpr double kLeastStrays = 9;   // texels in it
constexpr double kRidge = 1e-3;      // holds slopes back, so that texels in one line or one corner give an answer too

// Sums over a window's texels for a first-order regression over their offsets x, y [texels].
struct Moments {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  void Add(double dx, double dy) {
    n += 1;
    x += dx;
    y += dy;
    xx += dx * dx;
    xy += dx * dy;
    yy += dy * dy;
  }
};

// The regression's value at the window's centre is the sum of the values with weights constant + x dx + y dy.
struct Weights {
  double constant, x, y;

  // First row of the inverse of the normal equations.
  explicit Weights(const Moments& m) {
    const double xx = m.xx + kRidge * m.n, yy = m.yy + kRidge * m.n;
    const double c0 = xx * yy - m.xy * m.xy, c1 = m.xy * m.y - m.x * yy, c2 = m.x * m.xy - xx * m.y;
    const double det = m.n * c0 + m.x * c1 + m.y * c2;
    constant = c0 / det;
    x = c1 / det;
    y = c2 / det;
  }
  double At(int dx, int dy) const { return constant + x * dx + y * dy; }
  // Sum of the squared weights.
  double Square(const Moments& m) const {
    return constant * constant * m.n + x * x * m.xx + y * y * m.yy +
           2 * (constant * x * m.x + constant * y * m.y + x * y * m.xy);
  }
};

}  // namespace

uint8_t ConnectTexel(const World& world, const TexelMap& map, uint32_t texel, int64_t& rays) {
  const Texel& a = map.texels[texel];
  const PageSize page = map.pages[a.page];
  uint8_t open = 0;
  for (size_t k = 0; k < 4; ++k) {
    const int x = a.x + kNeighbours[k][0], y = a.y + kNeighbours[k][1];
    if (x < 0 || y < 0 || x >= page.width || y >= page.height) continue;
    const int32_t other =
        map.texel_at[a.page][static_cast<size_t>(y) * static_cast<size_t>(page.width) + static_cast<size_t>(x)];
    if (other < 0) continue;
    const Texel& b = map.texels[other];
    if (a.chart != b.chart || Dot(a.normal, b.normal) < kSameFacing) continue;
    const float lift = kLift * Length(b.position - a.position);
    const Vec3f from = a.position + a.normal * lift, way = b.position + b.normal * lift - from;
    const float length = Length(way);
    if (length > 0) {
      ++rays;
      if (world.Occluded({from, way / length, length, 0})) continue;
    }
    open |= static_cast<uint8_t>(1U << k);
  }
  return open;
}

void SmoothGrid::Connect(int x, int y, int k) {
  const int nx = x + kNeighbours[k][0], ny = y + kNeighbours[k][1];
  if (!Contains(nx, ny)) return;
  At(x, y).open |= static_cast<uint8_t>(1U << k);
  At(nx, ny).open |= static_cast<uint8_t>(1U << ((k + 4) % 8));
}

float SmoothGrid::PooledVariance(int x, int y) const {
  const SmoothCell& cell = At(x, y);
  float sum = cell.variance;
  int count = 1;
  for (size_t k = 0; k < kNeighbours.size(); ++k) {
    if (!(cell.open >> k & 1)) continue;
    const SmoothCell& other = At(x + kNeighbours[k][0], y + kNeighbours[k][1]);
    if (!other.known) continue;
    sum += other.variance;
    ++count;
  }
  return sum / static_cast<float>(count);
}

// A window that grows ring by ring.
class SmoothGrid::Growth {
 public:
  Growth(const SmoothGrid& grid, int x, int y) : grid_(grid), x_(x), y_(y) { Add(0, 0); }

  int radius() const { return radius_; }
  const Moments& known() const { return known_; }  // texels with a value
  const Moments& all() const { return all_; }
  double mean_variance() const { return variance_ / known_.n; }
  // Mean square distance of the values from the plane that fits them best, without what the fit takes off.
  double Stray() const {
    const Moments& m = known_;
    if (m.n < kLeastStrays) return kInfinity;
    // Values are counted from their mean.
    const double mean = value_ / m.n, vx = value_x_ - mean * m.x, vy = value_y_ - mean * m.y;
    const double xx = m.xx - m.x * m.x / m.n, xy = m.xy - m.x * m.y / m.n, yy = m.yy - m.y * m.y / m.n;
    const double det = xx * yy - xy * xy;
    if (!(det > 1e-6 * xx * yy)) return kInfinity;
    const double slope_x = (yy * vx - xy * vy) / det, slope_y = (xx * vy - xy * vx) / det;
    const double square = square_ - value_ * mean - slope_x * vx - slope_y * vy;
    return std::max(0.0, square) / (m.n - 3);
  }
  bool Has(int dx, int dy) const { return inside_[Window::Index(dx, dy)]; }

  // The regression's value at the centre.
  double Estimate(const Weights& w) const { return w.constant * value_ + w.x * value_x_ + w.y * value_y_; }
  double Variance(const Weights& w) const { return w.Square(known_) * mean_variance(); }

  Smoothed Result(const Weights& weights, double estimate) const {
    const double square = known_.n == all_.n ? weights.Square(known_) : Weights(all_).Square(all_);
    return {static_cast<float>(estimate), static_cast<float>(square * mean_variance())};
  }

  // Adds the next ring's texels that are connected to the window. False where there are none.
  bool Grow() {
    const int r = ++radius_;
    int joined = 0;
    // There and back again, so that texels of the ring that are reached along it join too.
    for (const bool forth : {true, false}) {
      if (joined == 8 * r) break;
      for (int step = 0; step < 8 * r; ++step) {
        const int s = forth ? step : 8 * r - 1 - step, along = s % (2 * r) - r;
        switch (s / (2 * r)) {
          case 0:
            joined += TryJoin(along, -r) ? 1 : 0;
            break;
          case 1:
            joined += TryJoin(r, along) ? 1 : 0;
            break;
          case 2:
            joined += TryJoin(-along, r) ? 1 : 0;
            break;
          default:
            joined += TryJoin(-r, -along) ? 1 : 0;
        }
      }
    }
    return joined > 0;
  }

 private:
  bool TryJoin(int dx, int dy) {
    const int x = x_ + dx, y = y_ + dy;
    if (!grid_.Contains(x, y) || inside_[Window::Index(dx, dy)]) return false;
    const uint8_t open = grid_.At(x, y).open;
    if (open == 0) return false;
    // Towards the centre first: on a plain surface that is all there is to ask.
    const size_t inward = Direction((dx < 0) - (dx > 0), (dy < 0) - (dy > 0));
    for (size_t turn = 0; turn < kNeighbours.size(); ++turn) {
      const size_t k = (inward + turn) % kNeighbours.size();
      if (!(open >> k & 1)) continue;
      const int ix = dx + kNeighbours[k][0], iy = dy + kNeighbours[k][1];
      if (std::max(std::abs(ix), std::abs(iy)) > radius_ || !inside_[Window::Index(ix, iy)]) continue;
      Add(dx, dy);
      return true;
    }
    return false;
  }

  static size_t Direction(int dx, int dy) {
    constexpr std::array<uint8_t, 9> kDirection = {5, 6, 7, 4, 0, 0, 3, 2, 1};
    return kDirection[static_cast<size_t>(3 * (dy + 1) + dx + 1)];
  }

  void Add(int dx, int dy) {
    inside_[Window::Index(dx, dy)] = true;
    all_.Add(dx, dy);
    const SmoothCell& cell = grid_.At(x_ + dx, y_ + dy);
    if (!cell.known) return;
    known_.Add(dx, dy);
    const double value = static_cast<double>(cell.value);
    value_ += value;
    square_ += value * value;
    value_x_ += value * dx;
    value_y_ += value * dy;
    variance_ += static_cast<double>(cell.variance);
  }

  const SmoothGrid& grid_;
  const int x_, y_;
  int radius_ = 0;
  Moments known_, all_;
  double value_ = 0, square_ = 0, value_x_ = 0, value_y_ = 0, variance_ = 0;
  std::array<bool, (2 * kMostRadius + 1) * (2 * kMostRadius + 1)> inside_{};
};

float SmoothGrid::NoiseVariance(int x, int y) const {
  const float pooled = std::min(PooledVariance(x, y), kMostOverOwn * At(x, y).variance);
  if (!(pooled > 0)) return pooled;
  Growth window(*this, x, y);
  while (window.radius() < kStrayRadius && window.Grow()) {
  }
  return std::min(pooled, static_cast<float>(window.Stray()));
}

float SmoothGrid::Choose(int x, int y, Steps* steps) const {
  Growth window(*this, x, y);
  double low = -kInfinity, high = kInfinity, overlap = 0, variance = kInfinity;
  for (int radius = 0;; ++radius) {
    const Weights weights(window.known());
    const double estimate = window.Estimate(weights);
    // A window that takes in noisier texels must not widen its interval: quiet texels keep away from them.
    variance = std::min(variance, window.Variance(weights));
    const double reach = kConfidence * std::sqrt(variance);
    if (steps != nullptr) (*steps)[static_cast<size_t>(radius)] = window.Result(weights, estimate);
    low = std::max(low, estimate - reach);
    high = std::min(high, estimate + reach);
    const double before = overlap;
    overlap = high - low;
    if (overlap < 0) return static_cast<float>(radius - 1 + before / (before - overlap));
    if (radius == kMostRadius || !(window.mean_variance() > 0) || !window.Grow()) return static_cast<float>(radius);
  }
}

float SmoothGrid::Agree(int x, int y) const {
  const SmoothCell& cell = At(x, y);
  std::array<float, 9> radii{cell.radius};
  size_t count = 1;
  for (size_t k = 0; k < kNeighbours.size(); ++k) {
    if (!(cell.open >> k & 1)) continue;
    const SmoothCell& other = At(x + kNeighbours[k][0], y + kNeighbours[k][1]);
    if (!other.known) continue;
    size_t place = count++;
    for (; place > 0 && radii[place - 1] > other.radius; --place) radii[place] = radii[place - 1];
    radii[place] = other.radius;
  }
  return radii[(count - 1) / 2];
}

SmoothGrid::Window SmoothGrid::WindowOf(int x, int y, float radius) const {
  const int whole = static_cast<int>(radius);
  const float part = radius - static_cast<float>(whole);
  Growth growth(*this, x, y);
  while (growth.radius() < whole && growth.Grow()) {
  }
  Window window;
  AddWeights(growth, x, y, 1 - part, window);
  if (part > 0) {
    growth.Grow();
    AddWeights(growth, x, y, part, window);
  }
  return window;
}

void SmoothGrid::AddWeights(const Growth& growth, int x, int y, float share, Window& window) const {
  const Weights weights(growth.known());
  window.radius = growth.radius();
  for (int dy = -window.radius; dy <= window.radius; ++dy) {
    for (int dx = -window.radius; dx <= window.radius; ++dx) {
      if (!growth.Has(dx, dy) || !At(x + dx, y + dy).known) continue;
      window.weight[Window::Index(dx, dy)] += share * static_cast<float>(weights.At(dx, dy));
    }
  }
}

SmoothGrid::Smoothed SmoothGrid::SmoothedAt(int x, int y, float radius, Steps& steps) const {
  const size_t whole = static_cast<size_t>(radius), next = std::min<size_t>(whole + 1, kMostRadius);
  if (steps[whole].variance < 0 || steps[next].variance < 0) {
    Growth growth(*this, x, y);
    for (size_t r = 0; r <= next; ++r) {
      const Weights weights(growth.known());
      steps[r] = growth.Result(weights, growth.Estimate(weights));
      if (r < next) growth.Grow();
    }
  }
  const float part = radius - static_cast<float>(whole);
  return {steps[whole].value * (1 - part) + steps[next].value * part,
          steps[whole].variance * (1 - part) + steps[next].variance * part};
}

}  // namespace bakewell
