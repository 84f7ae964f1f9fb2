#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "client/gltf/file/source.h"

namespace bakewell::gltf {

// The most elements of an accessor that has no bytes behind it (no buffer view): a tiny file must not ask for
// gigabytes.
inline constexpr uint64_t kMaxUnbackedElements = uint64_t{1} << 20;

// All elements of an accessor as doubles, `components` (1 to 4) per element: any component type, normalised integers,
// byte stride, sparse. kInvalidArgument naming the accessor: another element type, a range that leaves its buffer view,
// a component type that does not exist. Not-a-number is passed on.
absl::StatusOr<std::vector<double>> ReadNumbers(const Source& source, int accessor, int components);

// An index accessor: unsigned scalars, each below `vertices`. kInvalidArgument naming the accessor and the place.
absl::StatusOr<std::vector<uint32_t>> ReadIndices(const Source& source, int accessor, uint64_t vertices);

// Chosen elements of an accessor, encoded as vertex attributes are: each padded to a multiple of 4 bytes.
struct Elements {
  std::string bytes;
  size_t stride_bytes = 0;
  bool padded = false;    // stride_bytes is more than an element
  nlohmann::json header;  // componentType, normalized, type; and min, max for vectors of numbers
};

// Elements `which` (each below the accessor's count, our own doing) in their own component type; those of a sparse
// accessor, and of one without bytes, as floats. kInvalidArgument as ReadNumbers.
absl::StatusOr<Elements> GatherElements(const Source& source, int accessor, std::span<const uint32_t> which);

}  // namespace bakewell::gltf
