#pragma once

#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

namespace bakewell::gltf {

// Warnings in the order of their first appearance, each once, at most kMost: a hostile file must not drown the log.
class Warnings {
 public:
  static constexpr size_t kMost = 1000;

  void Add(const std::string& text) {
    if (lines_.size() > kMost || !seen_.insert(text).second) return;
    lines_.push_back(lines_.size() < kMost ? text : "further warnings are left out");
  }
  std::vector<std::string> Take() { return std::move(lines_); }

 private:
  std::vector<std::string> lines_;
  std::unordered_set<std::string> seen_;
};

}  // namespace bakewell::gltf
