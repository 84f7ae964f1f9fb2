#pragma once

#include <cstdint>
#include <fstream>
#include <string>

#include "core/base/check.h"

namespace bakewell {

// How far the process's resident memory rises above what it was at the start of this object's life (Linux).
class PeakMemory {
 public:
  PeakMemory() {
    std::ofstream("/proc/self/clear_refs") << "5";  // forgets the peak so far
    start_kib_ = Read("VmRSS:");
  }
  int64_t GrownMegabytes() const { return (Read("VmHWM:") - start_kib_) / 1024; }

 private:
  static int64_t Read(const std::string& wanted) {
    std::ifstream status("/proc/self/status");
    for (std::string word; status >> word;) {
      int64_t kib = 0;
      if (word == wanted && status >> kib) return kib;
    }
    BAKEWELL_CHECK(false);
    return 0;
  }
  int64_t start_kib_ = 0;
};

}  // namespace bakewell
