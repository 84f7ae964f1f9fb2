#include "worker/filter/window.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "worker/filter/regression.h"

namespace bakewell {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kConfidence = 0.5;                   // half width of a confidence interval, in standard errors
constexpr double kDirectConfidence = 0.25;            // likewise, of direct light
constexpr double kFollowed = 2.5;                     // likewise, of a texel that follows its neighbours
constexpr float kMostOverOwn = 4;                     // times a texel's own variance that its neighbours may make of it
constexpr int kStrayRadius = 2;                       // of the window whose strays say how large the noise is
constexpr double kLeastStrays = 9;                    // texels in it
constexpr float kStraysByNoise = 4, kStraysMost = 8;  // standard errors; from there on it is a detail
constexpr float kNoiseStray = 2, kAdmittedStray = 3;  // likewise, of a texel's neighbours and its own: it is a stray
constexpr size_t kLeastVotes = 4;                     // neighbours that say whether it is

float MedianOf(std::array<float, kNeighbours.size()> values, size_t count) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(values.begin(), middle, values.begin() + static_cast<std::ptrdiff_t>(count));
  return *middle;
}

// One texel of a ring around a window: its offset, and which of kNeighbours lies towards the centre.
struct RingStep {
  int8_t dx, dy;
  uint8_t inward;
};

// The rings of a window, once around each.
class Rings {
 public:
  constexpr Rings() {
    size_t i = 0;
    for (int r = 1; r <= SmoothGrid::kMostRadius; ++r) {
      for (int s = 0; s < 8 * r; ++s) {
        const int along = s % (2 * r) - r;
        switch (s / (2 * r)) {
          case 0:
            steps_[i++] = Step(along, -r);
            break;
          case 1:
            steps_[i++] = Step(r, along);
            break;
          case 2:
            steps_[i++] = Step(-along, r);
            break;
          default:
            steps_[i++] = Step(-r, -along);
        }
      }
    }
  }
  // 8 r texels.
  constexpr std::span<const RingStep> Ring(int r) const {
    return std::span(steps_).subspan(static_cast<size_t>(4 * r * (r - 1)), static_cast<size_t>(8 * r));
  }

 private:
  static constexpr RingStep Step(int dx, int dy) {
    constexpr std::array<uint8_t, 9> kDirection = {5, 6, 7, 4, 0, 0, 3, 2, 1};
    const int in_x = (dx < 0) - (dx > 0), in_y = (dy < 0) - (dy > 0);
    return {static_cast<int8_t>(dx), static_cast<int8_t>(dy),
            kDirection[static_cast<size_t>(3 * (in_y + 1) + in_x + 1)]};
  }
  std::array<RingStep, static_cast<size_t>(4 * SmoothGrid::kMostRadius * (SmoothGrid::kMostRadius + 1))> steps_{};
};
constexpr Rings kRings;

}  // namespace

void SmoothGrid::Connect(int x, int y, int k) {
  const int nx = x + kNeighbours[k][0], ny = y + kNeighbours[k][1];
  if (!Contains(nx, ny)) return;
  At(x, y).open |= static_cast<uint8_t>(1U << k);
  At(nx, ny).open |= static_cast<uint8_t>(1U << ((k + 4) % 8));
}

void SmoothGrid::MeasureRoom() {
  // Chebyshev distance to the nearest texel that lacks a connection, by two sweeps.
  const auto sweep = [this](int x, int y, size_t first) {
    SmoothCell& cell = At(x, y);
    if (cell.open != 0xff) {
      cell.room = 0;
      return;
    }
    for (size_t k = first; k < first + 4; ++k) {
      const SmoothCell& other = At(x + kNeighbours[k][0], y + kNeighbours[k][1]);
      cell.room = std::min(cell.room, static_cast<uint8_t>(other.room + 1));
    }
  };
  constexpr size_t kLater = 0, kEarlier = 4;  // of kNeighbours, in reading order
  for (SmoothCell& cell : cells_) cell.room = kMostRadius;
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) sweep(x, y, kEarlier);
  }
  for (int y = height_; y-- > 0;) {
    for (int x = width_; x-- > 0;) sweep(x, y, kLater);
  }
  NumberParts();
}

void SmoothGrid::NumberParts() {
  constexpr uint8_t kMostParts = 255;
  uint8_t part = 0;
  std::vector<size_t> waiting;
  for (size_t first = 0; first < cells_.size(); ++first) {
    if (cells_[first].part != 0 || cells_[first].open == 0) continue;
    part = part % kMostParts + 1;
    cells_[first].part = part;
    waiting.push_back(first);
    while (!waiting.empty()) {
      const size_t at = waiting.back();
      waiting.pop_back();
      for (size_t k = 0; k < kNeighbours.size(); ++k) {
        if (!(cells_[at].open >> k & 1)) continue;
        const size_t next = at + static_cast<size_t>(kNeighbours[k][1] * width_ + kNeighbours[k][0]);
        if (cells_[next].part != 0) continue;
        cells_[next].part = part;
        waiting.push_back(next);
      }
    }
  }
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
  Growth(const SmoothGrid& grid, int x, int y)
      : grid_(grid), x_(x), y_(y), center_(&grid.At(x, y)), part_(center_->part) {
    Add(0, 0);
  }

  int radius() const { return radius_; }
  const RegressionMoments& known() const { return known_; }  // texels with a value
  const RegressionMoments& all() const { return all_; }
  double mean_variance() const { return variance_ / known_.n; }
  // Mean square distance of the values from the plane that fits them best, without what the fit takes off.
  double Stray() const {
    const RegressionMoments& m = known_;
    if (m.n < kLeastStrays) return kInfinity;
    // Values are counted from their mean.
    const double n = m.n, mean = value_ / n, vx = value_x_ - mean * m.x, vy = value_y_ - mean * m.y;
    const double xx = m.xx - m.x * m.x / n, xy = m.xy - m.x * m.y / n, yy = m.yy - m.y * m.y / n;
    const double det = xx * yy - xy * xy;
    if (!(det > 1e-6 * xx * yy)) return kInfinity;
    const double slope_x = (yy * vx - xy * vy) / det, slope_y = (xx * vy - xy * vx) / det;
    const double square = square_ - value_ * mean - slope_x * vx - slope_y * vy;
    return std::max(0.0, square) / (m.n - 3);
  }
  bool Has(int dx, int dy) const {
    return std::max(std::abs(dx), std::abs(dy)) <= square_radius_ || inside_[Window::Index(dx, dy)];
  }

  // The regression's value at the centre.
  double Estimate(const RegressionWeights& w) const { return w.constant * value_ + w.x * value_x_ + w.y * value_y_; }
  double Variance(const RegressionWeights& w) const { return w.Square(known_) * mean_variance(); }

  Smoothed Result(const RegressionWeights& weights, double estimate) const {
    const double square = known_.n == all_.n ? weights.Square(known_) : RegressionWeights(all_).Square(all_);
    return {static_cast<float>(estimate), static_cast<float>(square * mean_variance()), static_cast<float>(square)};
  }

  // Adds the next ring's texels that are connected to the window. False where there are none.
  bool Grow() {
    const int r = ++radius_;
    if (r <= grid_.At(x_, y_).room) return AddRing();
    fits_ = x_ >= r && y_ >= r && x_ + r < grid_.width() && y_ + r < grid_.height();
    int joined = 0, left = 0;
    // There and back again, so that texels of the ring that are reached along it join too.
    const std::span<const RingStep> ring = kRings.Ring(r);
    for (const RingStep& step : ring) Try(step, joined, left);
    if (joined == 0 || left == 0) return joined > 0;
    for (size_t i = ring.size(); i-- > 0;) Try(ring[i], joined, left);
    return joined > 0;
  }

 private:
  void Try(const RingStep& step, int& joined, int& left) {
    if (!fits_ && !grid_.Contains(x_ + step.dx, y_ + step.dy)) return;
    const SmoothCell& cell = center_[step.dy * grid_.width() + step.dx];
    if (cell.part != part_ || cell.open == 0) return;
    bool& inside = inside_[Window::Index(step.dx, step.dy)];
    if (inside) return;
    // Towards the centre first: on a plain surface that is all there is to ask.
    const std::array<int, 2> in = kNeighbours[step.inward];
    if (cell.open >> step.inward & 1 && Has(step.dx + in[0], step.dy + in[1])) {
      inside = true;
      Add(step.dx, step.dy);
      ++joined;
      return;
    }
    for (size_t turn = 1; turn < kNeighbours.size(); ++turn) {
      const size_t k = (step.inward + turn) % kNeighbours.size();
      if (!(cell.open >> k & 1)) continue;
      const int ix = step.dx + kNeighbours[k][0], iy = step.dy + kNeighbours[k][1];
      if (std::max(std::abs(ix), std::abs(iy)) > radius_ || !Has(ix, iy)) continue;
      inside = true;
      Add(step.dx, step.dy);
      ++joined;
      return;
    }
    ++left;
  }

  // A ring of which everything is connected.
  bool AddRing() {
    const int r = square_radius_ = radius_;
    all_.AddRing(r);
    RowSums above = RowAt(-r, r), below = RowAt(r, r), left, right;
    for (int dy = 1 - r; dy < r; ++dy) {
      left.Add(grid_.At(x_ - r, y_ + dy), dy);
      right.Add(grid_.At(x_ + r, y_ + dy), dy);
    }
    if (above.known + below.known + left.known + right.known == 8 * r) {
      known_.AddRing(r);
    } else {
      for (int d = -r; d <= r; ++d) {
        for (const int dy : {-r, r}) known_.Add(d, dy, grid_.At(x_ + d, y_ + dy).known ? 1 : 0);
        if (std::abs(d) == r) continue;
        for (const int dx : {-r, r}) known_.Add(dx, d, grid_.At(x_ + dx, y_ + d).known ? 1 : 0);
      }
    }
    value_ += above.value + below.value + left.value + right.value;
    square_ += above.square + below.square + left.square + right.square;
    variance_ += above.variance + below.variance + left.variance + right.variance;
    value_x_ += above.moment + below.moment + r * (right.value - left.value);
    value_y_ += left.moment + right.moment + r * (below.value - above.value);
    return true;
  }

  // Over texels in a line, of those that are known.
  struct RowSums {
    int known = 0;
    double value = 0, square = 0, moment = 0, variance = 0;
    void Add(const SmoothCell& cell, int along) {
      const double v = cell.known ? static_cast<double>(cell.value) : 0;
      known += cell.known ? 1 : 0;
      value += v;
      square += v * v;
      moment += v * along;
      variance += cell.known ? static_cast<double>(cell.variance) : 0;
    }
  };
  RowSums RowAt(int dy, int reach) const {
    RowSums sums;
    const SmoothCell* row = &grid_.At(x_, y_ + dy);
    for (int dx = -reach; dx <= reach; ++dx) sums.Add(row[dx], dx);
    return sums;
  }

  void Add(int dx, int dy) {
    all_.Add(dx, dy, 1);
    const SmoothCell& cell = center_[dy * grid_.width() + dx];
    if (!cell.known) return;
    known_.Add(dx, dy, 1);
    const double value = static_cast<double>(cell.value);
    value_ += value;
    square_ += value * value;
    value_x_ += value * dx;
    value_y_ += value * dy;
    variance_ += static_cast<double>(cell.variance);
  }

  const SmoothGrid& grid_;
  const int x_, y_;
  const SmoothCell* const center_;
  const uint8_t part_;
  bool fits_ = false;                   // the ring lies on the grid
  int radius_ = 0, square_radius_ = 0;  // up to square_radius_ everything is inside
  RegressionMoments known_, all_;
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

SmoothGrid::Calm SmoothGrid::Calmed(int x, int y) const {
  const SmoothCell& cell = At(x, y);
  if (!(cell.variance > 0)) return {cell.value, 0, 0};
  Calm calm{cell.value, NoiseVariance(x, y), 0};
  std::array<float, kNeighbours.size()> values, variances;
  size_t count = 0;
  float value_sum = 0, variance_sum = 0;
  for (size_t k = 0; k < kNeighbours.size(); ++k) {
    if (!(cell.open >> k & 1)) continue;
    const SmoothCell& other = At(x + kNeighbours[k][0], y + kNeighbours[k][1]);
    if (!other.known) continue;
    values[count] = other.value;
    variances[count++] = other.variance;
    value_sum += other.value;
    variance_sum += other.variance;
  }
  if (count == 0) return calm;
  const auto n = static_cast<float>(count);
  const float of_all = std::sqrt((variance_sum + cell.variance) / n);  // of the difference from the neighbours' mean
  if (of_all > 0) calm.stray = std::fabs(cell.value - value_sum / n) / of_all;
  if (count < kLeastVotes) return calm;
  const float value = MedianOf(values, count), variance = MedianOf(variances, count);
  const float off = std::fabs(cell.value - value);
  const float share = std::clamp(kAdmittedStray + 1 - off / std::sqrt(cell.variance), 0.0f, 1.0f) *
                      std::clamp(off / std::sqrt(variance) / kNoiseStray - 1, 0.0f, 1.0f);
  if (share > 0) {
    calm.value += share * (value - calm.value);
    calm.variance += share * (variance - calm.variance);
  }
  return calm;
}

void SmoothGrid::Take(int x, int y, const Calm& calm) {
  SmoothCell& cell = At(x, y);
  cell.value = calm.value;
  cell.variance = calm.variance;
  cell.stray = calm.stray;
}

float SmoothGrid::Reach(int x, int y, double confidence, float most, Steps* steps) const {
  Growth window(*this, x, y);
  double low = -kInfinity, high = kInfinity, overlap = 0, variance = kInfinity;
  for (int radius = 0;; ++radius) {
    const RegressionWeights weights(window.known());
    const double estimate = window.Estimate(weights);
    // A window that takes in noisier texels must not widen its interval: quiet texels keep away from them.
    variance = std::min(variance, window.Variance(weights));
    const double reach = confidence * std::sqrt(variance);
    if (steps != nullptr) (*steps)[static_cast<size_t>(radius)] = window.Result(weights, estimate);
    low = std::max(low, estimate - reach);
    high = std::min(high, estimate + reach);
    const double before = overlap;
    overlap = high - low;
    if (overlap < 0) return std::min(most, static_cast<float>(radius - 1 + before / (before - overlap)));
    if (static_cast<float>(radius) >= most) return most;
    if (!(window.mean_variance() > 0) || !window.Grow()) return static_cast<float>(radius);
  }
}

float SmoothGrid::Choose(int x, int y, Steps* steps) const {
  return Reach(x, y, signal_ == Signal::kDirect ? kDirectConfidence : kConfidence, kMostRadius, steps);
}

float SmoothGrid::Agree(int x, int y) const {
  const SmoothCell& cell = At(x, y);
  if (!(cell.variance > 0)) return cell.radius;
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
  const float median = radii[(count - 1) / 2];
  if (median <= cell.radius) return median;
  const float follows = std::clamp((kStraysMost - cell.stray) / (kStraysMost - kStraysByNoise), 0.0f, 1.0f);
  const float radius = cell.radius + follows * (median - cell.radius);
  return std::max(cell.radius, Reach(x, y, kFollowed, radius, nullptr));
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
  const RegressionWeights weights(growth.known());
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
      const RegressionWeights weights(growth.known());
      steps[r] = growth.Result(weights, growth.Estimate(weights));
      if (r < next) growth.Grow();
    }
  }
  const float part = radius - static_cast<float>(whole);
  return {steps[whole].value * (1 - part) + steps[next].value * part,
          steps[whole].variance * (1 - part) + steps[next].variance * part,
          steps[whole].square * (1 - part) + steps[next].square * part};
}

}  // namespace bakewell
