#include <gtest/gtest.h>

#include "core/base/sha256.h"

namespace bakewell {
namespace {

TEST(Sha256, DigestOfAbcIsTheOneOfFips180) {
  const char text[] = {'a', 'b', 'c'};
  EXPECT_EQ(Sha256Of(std::as_bytes(std::span(text))).Hex(),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

}  // namespace
}  // namespace bakewell
