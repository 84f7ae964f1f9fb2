#pragma once

#include <string>

namespace bakewell {

// What a phase took.
struct PhaseTime {
  std::string phase;  // as Progress::Report names it
  double wall_seconds = 0;
  double cpu_seconds = 0;  // of all threads
};

}  // namespace bakewell
