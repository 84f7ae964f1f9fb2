#pragma once

#include <algorithm>
#include <string>
#include <vector>

namespace bakewell::gltf {

// Warnings in the order of their first appearance, each once.
class Warnings {
 public:
  void Add(const std::string& text) {
    if (std::find(lines_.begin(), lines_.end(), text) == lines_.end()) lines_.push_back(text);
  }
  std::vector<std::string> Take() { return std::move(lines_); }

 private:
  std::vector<std::string> lines_;
};

}  // namespace bakewell::gltf
