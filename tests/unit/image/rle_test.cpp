#include "core/image/rle.h"

#include <gtest/gtest.h>

#include "tests/support/statistics.h"

namespace bakewell {
namespace {

using Bytes = std::vector<uint8_t>;

// What a reader does, step by step.
Bytes Unpacked(const std::string& packed, size_t size) {
  if (packed.size() == size) return {packed.begin(), packed.end()};
  Bytes steps;
  for (size_t at = 0; at < packed.size();) {
    const int count = static_cast<signed char>(packed[at++]);
    if (count < 0) {
      steps.insert(steps.end(), packed.begin() + static_cast<ptrdiff_t>(at),
                   packed.begin() + static_cast<ptrdiff_t>(at) - count);
      at += static_cast<size_t>(-count);
    } else {
      steps.insert(steps.end(), static_cast<size_t>(count) + 1, static_cast<uint8_t>(packed[at++]));
    }
  }
  for (size_t i = 1; i < steps.size(); ++i) steps[i] = static_cast<uint8_t>(steps[i] + steps[i - 1] - 128);
  Bytes line(steps.size());
  for (size_t i = 0; i < line.size(); ++i) line[i] = steps[i / 2 + (i % 2 == 0 ? 0 : (line.size() + 1) / 2)];
  return line;
}

// Stretches of noise and of one byte, of any length.
Bytes Line(TestRandom& random, size_t size) {
  Bytes line;
  while (line.size() < size) {
    const auto length = static_cast<size_t>(random.Unit() < 0.5f ? 1 + 4 * random.Unit() : 700 * random.Unit());
    const bool noise = random.Unit() < 0.5f;
    const auto same = static_cast<uint8_t>(256 * random.Unit());
    for (size_t i = 0; i < length; ++i) line.push_back(noise ? static_cast<uint8_t>(256 * random.Unit()) : same);
  }
  line.resize(size);
  return line;
}

TEST(RleLines, EveryLineComesBackAndNoneGrows) {
  TestRandom random(1);
  RleLines lines;
  size_t packed_lines = 0;
  for (size_t k = 0; k < 3000; ++k) {
    const Bytes line = Line(random, k < 40 ? k : static_cast<size_t>(4000 * random.Unit()));
    std::string out = "before";
    lines.Append(line, out);
    const std::string packed = out.substr(6);
    ASSERT_LE(packed.size(), line.size());
    ASSERT_EQ(Unpacked(packed, line.size()), line) << k;
    if (packed.size() < line.size()) ++packed_lines;
  }
  EXPECT_GT(packed_lines, 1000u);
}

TEST(RleLines, ALineOfOneByteIsRunsOfTheGreatestLength) {
  std::string out;
  // The first step is the byte itself, the others are none: 128.
  RleLines().Append(Bytes(1 + 2 * 128, 7), out);
  EXPECT_EQ(out, std::string({-1, 7, 127, '\x80', 127, '\x80'}));
}

}  // namespace
}  // namespace bakewell
