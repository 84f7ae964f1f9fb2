#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace bakewell {

// Lines of an EXR file as its RLE compression has them: the bytes of even places before those of odd ones, each less
// the one before it, and runs of those. The bytes that OpenEXR's own encoder makes, which takes ten times as long. One
// thread.
class RleLines {
 public:
  // Appends the line, packed; as it is where that is not shorter.
  void Append(std::span<const uint8_t> line, std::string& out);

 private:
  void Prepare(std::span<const uint8_t> line);
  void AppendRuns(std::string& out) const;

  std::vector<uint8_t> split_, steps_;
  std::vector<uint8_t> run_begins_;  // 1 where three steps are the same
};

}  // namespace bakewell
