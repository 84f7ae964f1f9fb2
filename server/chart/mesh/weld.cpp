#include "server/chart/mesh/weld.h"

#include <algorithm>
#include <bit>

namespace bakewell::chart {
namespace {

uint64_t Mix(uint64_t h) {
  h ^= h >> 31;
  h *= 0x9E3779B97F4A7C15ull;
  h ^= h >> 29;
  h *= 0xBF58476D1CE4E5B9ull;
  return h ^ (h >> 32);
}

template <typename Key>
uint64_t HashOf(const Key& key) {
  return Mix(Mix((uint64_t{key[0]} << 32) | key[1]) ^ key[2]);
}

using Key = std::array<uint32_t, 3>;

// Open addressing over the indices of `keys`: for each key the previous equal one's slot value.
class KeyTable {
 public:
  explicit KeyTable(size_t count) : slots_(std::bit_ceil(2 * count + 2), UINT32_MAX) {}

  // The first index whose key equals keys[i]; i itself where there is none yet.
  uint32_t FirstEqual(const std::vector<Key>& keys, uint32_t i) {
    const size_t mask = slots_.size() - 1;
    for (size_t s = HashOf(keys[i]) & mask;; s = (s + 1) & mask) {
      if (slots_[s] == UINT32_MAX) slots_[s] = i;
      if (keys[slots_[s]] == keys[i]) return slots_[s];
    }
  }

 private:
  std::vector<uint32_t> slots_;
};

std::vector<uint32_t> FirstEqual(const std::vector<Key>& keys) {
  KeyTable table(keys.size());
  std::vector<uint32_t> first(keys.size());
  for (uint32_t i = 0; i < keys.size(); ++i) first[i] = table.FirstEqual(keys, i);
  return first;
}

}  // namespace

std::vector<uint32_t> WeldPositions(std::span<const Vec3f> position) {
  std::vector<Key> keys(position.size());
  for (size_t i = 0; i < keys.size(); ++i)
    for (int c = 0; c < 3; ++c) keys[i][c] = std::bit_cast<uint32_t>(position[i][c] + 0.0f);
  return FirstEqual(keys);
}

std::vector<uint32_t> CopyRank(std::span<const std::array<uint32_t, 3>> triangle) {
  std::vector<Key> keys(triangle.begin(), triangle.end());
  for (Key& key : keys) std::sort(key.begin(), key.end());
  const std::vector<uint32_t> first = FirstEqual(keys);
  std::vector<uint32_t> copies(triangle.size(), 0), rank(triangle.size());
  for (size_t i = 0; i < rank.size(); ++i) rank[i] = copies[first[i]]++;
  return rank;
}

}  // namespace bakewell::chart
