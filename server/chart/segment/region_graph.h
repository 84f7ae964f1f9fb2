#pragma once

#include <cstdint>
#include <vector>

#include "core/math/vec.h"
#include "server/chart/mesh/surface.h"

namespace bakewell::chart {

// A connected set of faces, as sums that add when two regions merge. Lengths in scaled units.
struct Region {
  Vec3d area_normal{0, 0, 0};  // sum of area * normal
  double area = 0;
  double outline = 0;  // length of its border
  uint32_t faces = 1;
  uint32_t edges = 3;  // of its border
  uint32_t first = 0;  // its least face: a name that the order of merges does not change
};

// The border that two regions share.
struct Link {
  uint32_t a = 0, b = 0;    // regions
  double length = 0;        // sum of edge lengths
  uint32_t edges = 0;       // how many
  double crease = 0;        // sum of length * (1 - cos of the dihedral angle)
  double sharpest = 0;      // largest 1 - cos of the dihedral angle
  double sharp = 0;         // sum of lengths of edges that turn by more than 30 degrees
  double texture_seam = 0;  // sum of lengths that are seams of the input UVs
  bool alive = true;
};

// Open-addressing map from a pair of regions to their link. Keys are never erased: a region that has been merged away
// is never asked for again.
class LinkTable {
 public:
  explicit LinkTable(size_t expected);
  // The link of (a, b), or kNone.
  uint32_t Find(uint32_t a, uint32_t b) const;
  void Insert(uint32_t a, uint32_t b, uint32_t link);

 private:
  size_t SlotOf(uint64_t key) const;
  void Grow();
  std::vector<uint64_t> key_;
  std::vector<uint32_t> link_;
  size_t used_ = 0;
};

// Regions, who borders whom, and merging, in O(n log n) for any order of merges: the region with fewer links is poured
// into the other. One thread.
class RegionGraph {
 public:
  // One region per face. seam as in Segment().
  RegionGraph(const Surface& surface, std::span<const uint8_t> seam);

  size_t LinkCount() const { return links_.size(); }
  const Link& LinkAt(uint32_t link) const { return links_[link]; }
  const Region& RegionAt(uint32_t region) const { return regions_[region]; }
  uint32_t Find(uint32_t face);
  // Joins the two regions of a living link. Returns the links whose length has changed.
  std::vector<uint32_t> Merge(uint32_t link);

 private:
  void AddEdge(const Surface& surface, uint32_t f, int k, bool seam);
  std::vector<uint32_t> parent_;
  std::vector<Region> regions_;
  std::vector<Link> links_;
  std::vector<std::vector<uint32_t>> links_of_;
  LinkTable table_;
};

}  // namespace bakewell::chart
