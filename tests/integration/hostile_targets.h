#pragma once

#include <string>
#include <vector>

#include "core/base/sha256.h"

namespace bakewell::test {

// A method, and a message that it would take.
struct Target {
  std::string method, valid;
};

// Every method of proto/bakewell/v1, with a message about that scene.
std::vector<Target> Targets(const Digest& scene);

// Bytes keyed by `seed`: random ones, or the valid message with a few bytes changed, cut, doubled or put in.
std::string Mutated(const std::string& valid, uint32_t seed);

}  // namespace bakewell::test
