#include "worker/filter/connections.h"

#include <algorithm>
#include <cstdlib>

namespace bakewell {

void Connections::Connect(int x, int y, int k) {
  const int nx = x + kNeighbours[k][0], ny = y + kNeighbours[k][1];
  if (!Contains(nx, ny)) return;
  At(x, y).open |= static_cast<uint8_t>(1U << k);
  At(nx, ny).open |= static_cast<uint8_t>(1U << ((k + 4) % 8));
}

void Connections::Finish() {
  MeasureRoom();
  NumberParts();
  FindConvex();
}

// Chebyshev distance to the nearest texel that lacks a connection, by two sweeps.
void Connections::MeasureRoom() {
  const auto sweep = [this](int x, int y, size_t first) {
    Cell& cell = At(x, y);
    if (cell.open != 0xff) {
      cell.room = 0;
      return;
    }
    for (size_t k = first; k < first + 4; ++k) {
      const Cell& other = At(x + kNeighbours[k][0], y + kNeighbours[k][1]);
      cell.room = std::min(cell.room, static_cast<uint8_t>(other.room + 1));
    }
  };
  constexpr size_t kLater = 0, kEarlier = 4;  // of kNeighbours, in reading order
  for (Cell& cell : cells_) cell.room = kWindowRadius;
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) sweep(x, y, kEarlier);
  }
  for (int y = height_; y-- > 0;) {
    for (int x = width_; x-- > 0;) sweep(x, y, kLater);
  }
}

void Connections::NumberParts() {
  constexpr uint16_t kMostParts = 65535;
  uint16_t part = 0;
  std::vector<size_t> waiting;
  for (size_t first = 0; first < cells_.size(); ++first) {
    if (cells_[first].part != 0 || cells_[first].open == 0) continue;
    part = static_cast<uint16_t>(part % kMostParts + 1);
    if (part >= convex_.size()) convex_.resize(part + size_t{1}, true);
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

// Convex in rows and columns (such polyominoes have monotone paths: Castiglione & Restivo 2003), and connected wherever
// its texels touch.
void Connections::FindConvex() {
  constexpr int kNone = -2;
  std::vector<int> line(convex_.size(), kNone), last(convex_.size(), kNone);
  const auto visit = [&](uint16_t part, int number, int at) {
    if (part == 0) return;
    if (line[part] == number && last[part] != at - 1) convex_[part] = false;
    line[part] = number;
    last[part] = at;
  };
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const Cell& cell = At(x, y);
      visit(cell.part, y, x);
      if (cell.part == 0 || cell.open == 0xff) continue;
      for (size_t k = 0; k < 4; ++k) {
        const int nx = x + kNeighbours[k][0], ny = y + kNeighbours[k][1];
        if (!(cell.open >> k & 1) && Contains(nx, ny) && At(nx, ny).part == cell.part) convex_[cell.part] = false;
      }
    }
  }
  std::fill(line.begin(), line.end(), kNone);
  for (int x = 0; x < width_; ++x) {
    for (int y = 0; y < height_; ++y) visit(At(x, y).part, x, y);
  }
}

namespace {

// One texel of a window, and its neighbour towards the centre.
struct Inward {
  int8_t dx, dy;
  uint8_t index, neighbour, direction;
};

// Ring by ring.
constexpr std::array<Inward, kWindow - 1> kInward = [] {
  std::array<Inward, kWindow - 1> steps{};
  size_t n = 0;
  for (int ring = 1; ring <= kWindowRadius; ++ring) {
    for (int dy = -ring; dy <= ring; ++dy) {
      for (int dx = -ring; dx <= ring; dx += dy == -ring || dy == ring ? 1 : 2 * ring) {
        constexpr std::array<uint8_t, 9> kDirection = {5, 6, 7, 4, 0, 0, 3, 2, 1};
        const int in_x = (dx < 0) - (dx > 0), in_y = (dy < 0) - (dy > 0);
        steps[n++] = {static_cast<int8_t>(dx), static_cast<int8_t>(dy), static_cast<uint8_t>(WindowIndex(dx, dy)),
                      static_cast<uint8_t>(WindowIndex(dx + in_x, dy + in_y)),
                      kDirection[static_cast<size_t>(3 * (in_y + 1) + in_x + 1)]};
      }
    }
  }
  return steps;
}();

}  // namespace

WindowSet Connections::CutOff(int x, int y) const {
  WindowSet same, reached;
  const uint16_t part = PartOf(x, y);
  if (part == 0 || convex_[part] || IsOpen(x, y)) return {};
  // Straight towards the centre: around a convex chart's border that is all there is.
  reached[WindowIndex(0, 0)] = true;
  for (const Inward& step : kInward) {
    if (!Contains(x + step.dx, y + step.dy)) continue;
    const Cell& cell = At(x + step.dx, y + step.dy);
    if (cell.part != part) continue;
    same[step.index] = true;
    reached[step.index] = reached[step.neighbour] && (cell.open >> step.direction & 1) != 0;
  }
  if ((same & ~reached).none()) return {};
  return same & ~Search(x, y);
}

// The texels of its window that are reached from (x, y).
WindowSet Connections::Search(int x, int y) const {
  WindowSet reached;
  std::array<std::array<int8_t, 2>, kWindow> waiting;
  size_t count = 0;
  const auto reach = [&](int dx, int dy) {
    const size_t index = WindowIndex(dx, dy);
    if (reached[index]) return;
    reached[index] = true;
    waiting[count++] = {static_cast<int8_t>(dx), static_cast<int8_t>(dy)};
  };
  reach(0, 0);
  while (count > 0) {
    const auto [dx, dy] = waiting[--count];
    const uint8_t open = At(x + dx, y + dy).open;
    for (size_t k = 0; k < kNeighbours.size(); ++k) {
      if (!(open >> k & 1)) continue;
      const int nx = dx + kNeighbours[k][0], ny = dy + kNeighbours[k][1];
      if (std::max(std::abs(nx), std::abs(ny)) <= kWindowRadius) reach(nx, ny);
    }
  }
  return reached;
}

}  // namespace bakewell
