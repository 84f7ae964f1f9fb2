#include "core/artifact/task.h"

#include <gtest/gtest.h>

namespace bakewell {
namespace {

TaskSpec Example() {
  TaskSpec spec{"photon/emit", 3, "batch=1", {}};
  spec.inputs.push_back({"scene", Sha256Of("scene")});
  spec.inputs.push_back({"layout", OutputOf{TaskKey{Sha256Of("chart")}, "layout"}});
  return spec;
}

TEST(TaskSpec, ParseOfSerializeIsTheSameSpec) {
  const auto parsed = ParseSpec(SerializeSpec(Example()));
  ASSERT_TRUE(parsed.ok()) << parsed.status();
  EXPECT_EQ(*parsed, Example());
}

TEST(TaskSpec, EveryPrefixIsRefused) {
  const std::string bytes = SerializeSpec(Example());
  for (size_t size = 0; size < bytes.size(); ++size) EXPECT_FALSE(ParseSpec(bytes.substr(0, size)).ok()) << size;
}

TEST(TaskSpec, EveryFieldChangesTheKey) {
  const TaskKey key = KeyOf(Example());
  TaskSpec kind = Example(), version = Example(), settings = Example(), input = Example(), name = Example();
  kind.kind = "photon/density";
  version.code_version = 4;
  settings.settings = "batch=2";
  input.inputs[0].source = Sha256Of("other scene");
  name.inputs[0].name = "level";
  for (const TaskSpec& other : {kind, version, settings, input, name}) EXPECT_NE(KeyOf(other), key);
  EXPECT_EQ(KeyOf(Example()), key);
}

TEST(TaskSpec, NeighbouringStringsDoNotRunIntoEachOther) {
  TaskSpec a{"ab", 0, "c", {}}, b{"a", 0, "bc", {}};
  EXPECT_NE(KeyOf(a), KeyOf(b));
}

TEST(TaskSpec, ImpossibleCountIsRefusedWithoutAllocating) {
  std::string bytes = SerializeSpec(TaskSpec{"k", 1, "", {}});
  bytes.replace(bytes.size() - 4, 4, "\xff\xff\xff\x7f");
  EXPECT_EQ(ParseSpec(bytes).status().code(), absl::StatusCode::kDataLoss);
}

TEST(TaskOutputs, RoundTripAndPrefixes) {
  const TaskOutputs outputs = {{"flux", Sha256Of("f"), 12}, {"log", Sha256Of("l"), 0}};
  const std::string bytes = SerializeOutputs(outputs);
  EXPECT_EQ(*ParseOutputs(bytes), outputs);
  for (size_t size = 0; size < bytes.size(); ++size) EXPECT_FALSE(ParseOutputs(bytes.substr(0, size)).ok()) << size;
}

TEST(PlainPath, LetsNoPathTrickThrough) {
  for (const char* good : {"a", "page0.exr", "probes/room-1.ktx2", "a/b/c/d"}) EXPECT_TRUE(IsPlainPath(good)) << good;
  for (const char* bad :
       {"", ".", "..", "../a", "a/../b", "/etc/passwd", "a//b", "a/", "a\\b", "a b", "a/b/c/d/e", "\xc0\xae", "a:b"}) {
    EXPECT_FALSE(IsPlainPath(bad)) << bad;
  }
  EXPECT_FALSE(IsPlainPath(std::string("a\0b", 3)));
}

TEST(DigestText, HexAndBytesComeBack) {
  const Digest digest = Sha256Of("abc");
  EXPECT_EQ(*DigestFromHex(digest.Hex()), digest);
  EXPECT_EQ(*DigestFromBytes(DigestToBytes(digest)), digest);
  EXPECT_FALSE(DigestFromHex("12").ok());
  EXPECT_FALSE(DigestFromHex(std::string(64, 'g')).ok());
  EXPECT_FALSE(DigestFromBytes("short").ok());
}

}  // namespace
}  // namespace bakewell
