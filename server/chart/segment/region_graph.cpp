#include "server/chart/segment/region_graph.h"

#include <algorithm>
#include <bit>
#include <numeric>

namespace bakewell::chart {
namespace {

constexpr uint64_t kEmpty = UINT64_MAX;
constexpr double kSharpCrease = 0.134;  // 1 - cos(30 degrees)

uint64_t PairKey(uint32_t a, uint32_t b) { return (uint64_t{std::min(a, b)} << 32) | std::max(a, b); }

}  // namespace

LinkTable::LinkTable(size_t expected) : key_(std::bit_ceil(2 * expected + 2), kEmpty), link_(key_.size(), kNone) {}

size_t LinkTable::SlotOf(uint64_t key) const {
  const size_t mask = key_.size() - 1;
  uint64_t hash = key * 0x9E3779B97F4A7C15ull;
  hash ^= hash >> 29;
  size_t slot = hash & mask;
  while (key_[slot] != kEmpty && key_[slot] != key) slot = (slot + 1) & mask;
  return slot;
}

uint32_t LinkTable::Find(uint32_t a, uint32_t b) const { return link_[SlotOf(PairKey(a, b))]; }

void LinkTable::Insert(uint32_t a, uint32_t b, uint32_t link) {
  if (2 * used_ >= key_.size()) Grow();
  const size_t slot = SlotOf(PairKey(a, b));
  if (key_[slot] == kEmpty) ++used_;
  key_[slot] = PairKey(a, b);
  link_[slot] = link;
}

void LinkTable::Grow() {
  std::vector<uint64_t> old_key(2 * key_.size(), kEmpty);
  std::vector<uint32_t> old_link(2 * key_.size(), kNone);
  std::swap(old_key, key_);
  std::swap(old_link, link_);
  for (size_t i = 0; i < old_key.size(); ++i) {
    if (old_key[i] == kEmpty) continue;
    const size_t slot = SlotOf(old_key[i]);
    key_[slot] = old_key[i];
    link_[slot] = old_link[i];
  }
}

RegionGraph::RegionGraph(const Surface& surface, std::span<const uint8_t> seam)
    : parent_(surface.FaceCount()),
      regions_(surface.FaceCount()),
      links_of_(surface.FaceCount()),
      table_(3 * surface.FaceCount() / 2) {
  std::iota(parent_.begin(), parent_.end(), 0u);
  links_.reserve(3 * surface.FaceCount() / 2);
  for (uint32_t f = 0; f < surface.FaceCount(); ++f) {
    regions_[f].area_normal = surface.normal[f] * surface.area[f];
    regions_[f].area = surface.area[f];
    regions_[f].first = f;
    for (int k = 0; k < 3; ++k) {
      regions_[f].outline += surface.EdgeLength(f, k);
      if (surface.across[f][k] != kNone && f < surface.across[f][k])
        AddEdge(surface, f, k, !seam.empty() && seam[3 * f + k]);
    }
  }
}

void RegionGraph::AddEdge(const Surface& surface, uint32_t f, int k, bool seam) {
  const uint32_t other = surface.across[f][k];
  uint32_t link = table_.Find(f, other);
  if (link == kNone) {
    link = static_cast<uint32_t>(links_.size());
    links_.push_back({.a = f, .b = other});
    table_.Insert(f, other, link);
    links_of_[f].push_back(link);
    links_of_[other].push_back(link);
  }
  const double length = surface.EdgeLength(f, k);
  const double crease = 1 - Dot(surface.normal[f], surface.normal[other]);
  links_[link].length += length;
  ++links_[link].edges;
  links_[link].sharpest = std::max(links_[link].sharpest, crease);
  links_[link].crease += length * crease;
  if (crease > kSharpCrease) links_[link].sharp += length;
  if (seam) links_[link].texture_seam += length;
}

uint32_t RegionGraph::Find(uint32_t face) {
  while (parent_[face] != face) face = parent_[face] = parent_[parent_[face]];
  return face;
}

std::vector<uint32_t> RegionGraph::Merge(uint32_t link) {
  uint32_t large = links_[link].a, small = links_[link].b;
  if (links_of_[large].size() < links_of_[small].size()) std::swap(large, small);
  regions_[large].area_normal += regions_[small].area_normal;
  regions_[large].area += regions_[small].area;
  regions_[large].faces += regions_[small].faces;
  regions_[large].outline = std::max(0.0, regions_[large].outline + regions_[small].outline - 2 * links_[link].length);
  regions_[large].edges = regions_[large].edges + regions_[small].edges - 2 * links_[link].edges;
  regions_[large].first = std::min(regions_[large].first, regions_[small].first);
  parent_[small] = large;
  links_[link].alive = false;

  std::vector<uint32_t> changed;
  for (const uint32_t l : links_of_[small]) {
    Link& moved = links_[l];
    if (!moved.alive) continue;
    const uint32_t other = moved.a == small ? moved.b : moved.a;
    const uint32_t existing = table_.Find(large, other);
    if (existing != kNone && links_[existing].alive) {
      Link& kept = links_[existing];
      kept.length += moved.length;
      kept.edges += moved.edges;
      kept.sharpest = std::max(kept.sharpest, moved.sharpest);
      kept.crease += moved.crease;
      kept.sharp += moved.sharp;
      kept.texture_seam += moved.texture_seam;
      moved.alive = false;
      changed.push_back(existing);
    } else {
      moved.a = large;
      moved.b = other;
      table_.Insert(large, other, l);
      links_of_[large].push_back(l);
      changed.push_back(l);
    }
  }
  links_of_[small] = {};
  return changed;
}

}  // namespace bakewell::chart
