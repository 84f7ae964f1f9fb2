#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace bakewell {

// The eight neighbours of a texel. Direction k + 4 is the opposite of k.
inline constexpr std::array<std::array<int, 2>, 8> kNeighbours = {
    {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};

// The window that a texel's light may be averaged over: the square of texels at most kWindowRadius away.
inline constexpr int kWindowRadius = 4, kWindowSide = 2 * kWindowRadius + 1, kWindow = kWindowSide * kWindowSide;
inline constexpr size_t WindowIndex(int dx, int dy) {
  return static_cast<size_t>((dy + kWindowRadius) * kWindowSide + dx + kWindowRadius);
}
// Some of its texels, by WindowIndex.
using WindowSet = std::bitset<kWindow>;

// Which texels of a rectangle light may be averaged over: not past a wall, a sharp edge, another chart or an invalid
// texel.
class Connections {
 public:
  Connections(int width, int height)
      : width_(width), height_(height), cells_(static_cast<size_t>(width) * static_cast<size_t>(height)) {}

  int width() const { return width_; }
  int height() const { return height_; }
  bool Contains(int x, int y) const { return x >= 0 && y >= 0 && x < width_ && y < height_; }

  // Connects (x, y) with its neighbour in direction k, if that lies on the rectangle.
  void Connect(int x, int y, int k);
  // After the last Connect, before what follows.
  void Finish();

  // Connected texels have the same number, most others do not; 0: connected to nothing.
  uint16_t PartOf(int x, int y) const { return At(x, y).part; }
  // What must not count in the mean of (x, y) though it has the same number: the texels of its window that are not
  // reached from neighbour to neighbour without leaving the window.
  WindowSet CutOff(int x, int y) const;

 private:
  struct Cell {
    uint8_t open = 0;  // bit k: connected to neighbour k; mutual
    uint8_t room = 0;  // rings around it whose texels are all connected
    uint16_t part = 0;
  };
  Cell& At(int x, int y) { return cells_[Place(x, y)]; }
  const Cell& At(int x, int y) const { return cells_[Place(x, y)]; }
  size_t Place(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
  }
  // All texels of its window are connected with each other.
  bool IsOpen(int x, int y) const { return At(x, y).room >= kWindowRadius; }
  // Rows of a window, from the top; bit i: dx = i - kWindowRadius.
  using WindowRows = std::array<uint32_t, kWindowSide>;
  WindowRows Open(int x, int y, size_t k) const;
  WindowRows Search(int x, int y) const;
  void MeasureRoom();
  void NumberParts();
  void PackOpen();

  int width_, height_;
  std::vector<Cell> cells_;
  // Of the first four directions, bit k of Cell::open; row by row, a window's radius wider on all sides.
  std::array<std::vector<uint64_t>, 4> packed_;
  size_t packed_row_ = 0;  // words
};

}  // namespace bakewell
