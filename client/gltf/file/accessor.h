#pragma once

#include <cstdint>
#include <vector>

#include "client/gltf/file/model.h"

namespace bakewell::gltf {

// A document beside its typed view: what readers are given.
struct Source {
  Document document;
  tinygltf::Model model;
};

// The most elements of an accessor that has no bytes behind it (no buffer view): a tiny file must not ask for
// gigabytes.
inline constexpr uint64_t kMaxUnbackedElements = uint64_t{1} << 24;

// All elements of an accessor as doubles, `components` (1 to 4) per element: any component type, normalised integers,
// byte stride, sparse. kInvalidArgument naming the accessor: another element type, a range that leaves its buffer view,
// a component type that does not exist. Not-a-number is passed on.
absl::StatusOr<std::vector<double>> ReadNumbers(const Source& source, int accessor, int components);

// An index accessor: unsigned scalars, each below `vertices`. kInvalidArgument naming the accessor and the place.
absl::StatusOr<std::vector<uint32_t>> ReadIndices(const Source& source, int accessor, uint64_t vertices);

}  // namespace bakewell::gltf
