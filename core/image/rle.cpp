#include "core/image/rle.h"

#include <algorithm>
#include <cstring>

namespace bakewell {

void RleLines::Append(std::span<const uint8_t> line, std::string& out) {
  const size_t begin = out.size();
  Prepare(line);
  AppendRuns(out);
  if (out.size() - begin < line.size()) return;
  out.resize(begin);
  out.append(reinterpret_cast<const char*>(line.data()), line.size());
}

void RleLines::Prepare(std::span<const uint8_t> line) {
  const size_t size = line.size(), half = (size + 1) / 2;
  split_.resize(size);
  steps_.resize(size);
  run_begins_.assign(size, 0);
  // Locals: what bytes are written to could otherwise be the vectors themselves.
  const uint8_t* const from = line.data();
  uint8_t *const split = split_.data(), *const odd = split + half, *const steps = steps_.data();
  uint8_t* const run_begins = run_begins_.data();
  for (size_t i = 0; i < size / 2; ++i) {
    split[i] = from[2 * i];
    odd[i] = from[2 * i + 1];
  }
  if (size % 2 == 1) split[half - 1] = from[size - 1];
  if (size > 0) steps[0] = split[0];
  for (size_t i = 1; i < size; ++i) steps[i] = static_cast<uint8_t>(split[i] - split[i - 1] + 128);
  for (size_t i = 0; i + 2 < size; ++i) {
    run_begins[i] = static_cast<uint8_t>((steps[i] == steps[i + 1]) & (steps[i + 1] == steps[i + 2]));
  }
}

// A run is its length less one and its byte; what lies between runs is the negative of its length and its bytes.
void RleLines::AppendRuns(std::string& out) const {
  constexpr size_t kMost = 127;
  const size_t size = steps_.size();
  for (size_t at = 0; at < size;) {
    const uint8_t* const here = steps_.data() + at;
    size_t length = 1;
    if (run_begins_[at] != 0) {
      const size_t most = std::min(kMost + 1, size - at);
      while (length < most && here[length] == *here) ++length;
      out.push_back(static_cast<char>(length - 1));
      out.push_back(static_cast<char>(*here));
    } else {
      const size_t most = std::min(kMost, size - at);
      const void* const run = std::memchr(run_begins_.data() + at, 1, most);
      length = run == nullptr ? most : static_cast<size_t>(static_cast<const uint8_t*>(run) - run_begins_.data()) - at;
      out.push_back(static_cast<char>(-static_cast<int>(length)));
      out.append(reinterpret_cast<const char*>(here), length);
    }
    at += length;
  }
}

}  // namespace bakewell
