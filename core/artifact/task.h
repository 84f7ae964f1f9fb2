#pragma once

#include <compare>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "core/base/fields.h"
#include "core/base/sha256.h"
#include "core/base/status.h"

namespace bakewell {

// The unit of work that coordinator, workers and clients agree on: a pure function from bytes by digest and settings to
// bytes by digest. Equal keys mean equal output bytes, so a key that is known is never run again.

// What a task is known by: SHA-256 of its kind, code version, settings and inputs.
struct TaskKey {
  Digest digest;
  friend auto operator<=>(const TaskKey&, const TaskKey&) = default;
};

struct TaskKeyHash {
  size_t operator()(const TaskKey& key) const { return DigestHash()(key.digest); }
};

// An input that another task of the same job makes.
struct OutputOf {
  TaskKey task;
  std::string output;
  friend bool operator==(const OutputOf&, const OutputOf&) = default;
};

struct TaskInput {
  std::string name;
  std::variant<Digest, OutputOf> source;
  friend bool operator==(const TaskInput&, const TaskInput&) = default;
};

struct TaskSpec {
  std::string kind;           // "photon/emit"; at most kMaxNameBytes
  uint32_t code_version = 0;  // raised whenever the kind's bytes change for equal inputs
  std::string settings;       // canonical bytes of the settings that change the result, and nothing else
  std::vector<TaskInput> inputs;
  friend bool operator==(const TaskSpec&, const TaskSpec&) = default;
};

struct TaskOutput {
  std::string name;
  Digest digest;
  int64_t size_bytes = 0;
  friend bool operator==(const TaskOutput&, const TaskOutput&) = default;
};
using TaskOutputs = std::vector<TaskOutput>;

// Limits of what is read from the wire or the database.
inline constexpr size_t kMaxNameBytes = 64;
inline constexpr size_t kMaxSettingsBytes = 64 << 10;
inline constexpr size_t kMaxTaskInputs = 65536;
inline constexpr size_t kMaxTaskOutputs = 4096;

// A pure function of the spec. The key of a spec whose inputs are OutputOf is its *plan key*, known before anything has
// run; once every input is a digest it is the *action key*, which is equal for tasks whose inputs turned out equal.
TaskKey KeyOf(const TaskSpec& spec);

// True if every input is a digest.
bool IsResolved(const TaskSpec& spec);

// Canonical bytes and back. Parsers are safe on hostile bytes: kDataLoss if malformed or above the limits.
std::string SerializeSpec(const TaskSpec& spec);
absl::StatusOr<TaskSpec> ParseSpec(std::string_view bytes);
std::string SerializeOutputs(const TaskOutputs& outputs);
absl::StatusOr<TaskOutputs> ParseOutputs(std::string_view bytes);

// The same for a spec inside a longer stream; failures are left in `reader`.
void WriteSpec(const TaskSpec& spec, FieldWriter& writer);
TaskSpec ReadSpec(FieldReader& reader);

// A name that may become part of a file's path: 1 to 64 characters of [A-Za-z0-9_.-] and no leading dot; and "a/b" of
// such parts, at most four, where a folder is wanted.
bool IsPlainName(std::string_view name);
bool IsPlainPath(std::string_view path);

}  // namespace bakewell
