#include "worker/filter/connections.h"

#include <algorithm>
#include <bit>

namespace bakewell {
namespace {

constexpr uint32_t kWholeRow = (1U << kWindowSide) - 1;  // of a window

}  // namespace

void Connections::Connect(int x, int y, int k) {
  const int nx = x + kNeighbours[k][0], ny = y + kNeighbours[k][1];
  if (!Contains(nx, ny)) return;
  At(x, y).open |= static_cast<uint8_t>(1U << k);
  At(nx, ny).open |= static_cast<uint8_t>(1U << ((k + 4) % 8));
}

void Connections::Finish() {
  MeasureRoom();
  NumberParts();
  PackOpen();
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

void Connections::PackOpen() {
  constexpr size_t kBits = 64;
  packed_row_ = (static_cast<size_t>(width_) + 2 * kWindowRadius) / kBits + 2;
  for (size_t k = 0; k < packed_.size(); ++k) {
    packed_[k].assign(packed_row_ * (static_cast<size_t>(height_) + 2 * kWindowRadius), 0);
    for (int y = 0; y < height_; ++y) {
      uint64_t* const row = &packed_[k][static_cast<size_t>(y + kWindowRadius) * packed_row_];
      for (int x = 0; x < width_; ++x) {
        const auto bit = static_cast<size_t>(x + kWindowRadius);
        row[bit / kBits] |= uint64_t{At(x, y).open >> k & 1U} << bit % kBits;
      }
    }
  }
}

// Which texels of the window of (x, y) are connected with their neighbour in direction k < 4.
Connections::WindowRows Connections::Open(int x, int y, size_t k) const {
  constexpr size_t kBits = 64;
  const size_t first = static_cast<size_t>(x), shift = first % kBits;
  const uint64_t* word = &packed_[k][static_cast<size_t>(y) * packed_row_ + first / kBits];
  WindowRows rows;
  for (uint32_t& row : rows) {
    // In two steps: a shift by 64 is not defined.
    row = static_cast<uint32_t>(word[0] >> shift | word[1] << 1 << (kBits - 1 - shift)) & kWholeRow;
    word += packed_row_;
  }
  return rows;
}

// The texels of its window that are reached from (x, y): whole rows at a time, down and up until there are no more.
Connections::WindowRows Connections::Search(int x, int y) const {
  const WindowRows right = Open(x, y, 0), down_right = Open(x, y, 1), down = Open(x, y, 2), down_left = Open(x, y, 3);
  WindowRows reached{}, before;
  reached[kWindowRadius] = 1U << kWindowRadius;
  const auto along = [&](size_t row) {
    uint32_t last;
    do {
      last = reached[row];
      reached[row] |= ((last & right[row]) << 1 | (last >> 1 & right[row])) & kWholeRow;
    } while (reached[row] != last);
  };
  do {
    before = reached;
    for (size_t row = 0; row < kWindowSide; ++row) {
      along(row);
      if (row + 1 == kWindowSide) break;
      const uint32_t from = reached[row];
      reached[row + 1] |=
          ((from & down[row]) | (from & down_right[row]) << 1 | (from & down_left[row]) >> 1) & kWholeRow;
    }
    for (size_t row = kWindowSide - 1; row-- > 0;) {
      const uint32_t from = reached[row + 1];
      reached[row] |= ((from & down[row]) | (from >> 1 & down_right[row]) | (from << 1 & down_left[row])) & kWholeRow;
      along(row);
    }
  } while (reached != before);
  return reached;
}

WindowSet Connections::CutOff(int x, int y) const {
  const uint16_t part = PartOf(x, y);
  if (part == 0 || IsOpen(x, y)) return {};
  const WindowRows reached = Search(x, y);
  WindowSet cut;
  for (int dy = -kWindowRadius; dy <= kWindowRadius; ++dy) {
    for (uint32_t rest = ~reached[static_cast<size_t>(dy + kWindowRadius)] & kWholeRow; rest != 0; rest &= rest - 1) {
      const int dx = std::countr_zero(rest) - kWindowRadius;
      if (Contains(x + dx, y + dy) && PartOf(x + dx, y + dy) == part) cut[WindowIndex(dx, dy)] = true;
    }
  }
  return cut;
}

}  // namespace bakewell
