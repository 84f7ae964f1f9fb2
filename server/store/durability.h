#pragma once

#include <cstdint>

namespace bakewell::store {

// What a store promises of what it has acknowledged.
enum class Durability : uint8_t {
  kSafe,     // it survives kill -9 and power loss
  kScratch,  // it lives as long as the process: nothing is synced, files lie in one folder
};

}  // namespace bakewell::store
