#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <mutex>
#include <string>
#include <vector>

#include "tests/support/farm.h"
#include "tests/support/temp_dir.h"

namespace bakewell::test {

// A farm whose log is kept, and a small scene for it.
class LoggedFarm : public testing::Test {
 protected:
  Farm::Options OptionsHere() {
    Farm::Options options;
    options.folder = dir.path() / "farm";
    options.job.log = [this](std::string_view line) {
      const std::lock_guard lock(mutex);
      log.emplace_back(line);
    };
    return options;
  }
  int64_t LinesWith(const std::string& text) {
    const std::lock_guard lock(mutex);
    return std::count_if(log.begin(), log.end(),
                         [&](const std::string& line) { return line.find(text) != std::string::npos; });
  }

  TempDir dir{"/dev/shm"};
  SyntheticScene scene{4, 2, 1000, 0, 64, 1, true};
  std::mutex mutex;
  std::vector<std::string> log;
};

}  // namespace bakewell::test
