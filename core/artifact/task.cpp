#include "core/artifact/task.h"

#include <algorithm>

namespace bakewell {

namespace {

constexpr uint8_t kDigestInput = 0;
constexpr uint8_t kOutputInput = 1;

void WriteInput(const TaskInput& input, FieldWriter& writer) {
  writer.PutString(input.name);
  if (const Digest* digest = std::get_if<Digest>(&input.source)) {
    writer.Put(kDigestInput);
    writer.PutDigest(*digest);
    return;
  }
  const OutputOf& made = std::get<OutputOf>(input.source);
  writer.Put(kOutputInput);
  writer.PutDigest(made.task.digest);
  writer.PutString(made.output);
}

TaskInput ReadInput(FieldReader& reader) {
  TaskInput input;
  input.name = reader.GetString();
  if (reader.Get<uint8_t>() == kDigestInput) {
    input.source = reader.GetDigest();
    return input;
  }
  OutputOf made;
  made.task.digest = reader.GetDigest();
  made.output = reader.GetString();
  input.source = std::move(made);
  return input;
}

absl::Status CheckLimits(const TaskSpec& spec) {
  if (spec.kind.empty() || spec.kind.size() > kMaxNameBytes) return absl::DataLossError("task spec: bad kind");
  if (spec.settings.size() > kMaxSettingsBytes) return absl::DataLossError("task spec: settings above 64 KiB");
  return absl::OkStatus();
}

// The least bytes one element takes, so that a count can be refused before anything is allocated.
constexpr size_t kMinInputBytes = 4 + 1 + 32;
constexpr size_t kMinOutputBytes = 4 + 32 + 8;

}  // namespace

void WriteSpec(const TaskSpec& spec, FieldWriter& writer) {
  writer.PutString(spec.kind);
  writer.Put(spec.code_version);
  writer.PutString(spec.settings);
  writer.Put(static_cast<uint32_t>(spec.inputs.size()));
  for (const TaskInput& input : spec.inputs) WriteInput(input, writer);
}

TaskSpec ReadSpec(FieldReader& reader) {
  TaskSpec spec;
  spec.kind = reader.GetString();
  spec.code_version = reader.Get<uint32_t>();
  spec.settings = reader.GetString();
  const uint32_t count = reader.Get<uint32_t>();
  if (count > kMaxTaskInputs || count > reader.remaining() / kMinInputBytes) {
    reader = FieldReader({});
    reader.Get<uint8_t>();
    return spec;
  }
  spec.inputs.reserve(count);
  for (uint32_t i = 0; i < count; ++i) spec.inputs.push_back(ReadInput(reader));
  return spec;
}

std::string SerializeSpec(const TaskSpec& spec) {
  FieldWriter writer;
  WriteSpec(spec, writer);
  return std::move(writer).bytes();
}

absl::StatusOr<TaskSpec> ParseSpec(std::string_view bytes) {
  FieldReader reader(bytes);
  TaskSpec spec = ReadSpec(reader);
  BAKEWELL_RETURN_IF_ERROR(reader.Finish("task spec"));
  BAKEWELL_RETURN_IF_ERROR(CheckLimits(spec));
  return spec;
}

TaskKey KeyOf(const TaskSpec& spec) { return TaskKey{Sha256Of(SerializeSpec(spec))}; }

bool IsResolved(const TaskSpec& spec) {
  return std::all_of(spec.inputs.begin(), spec.inputs.end(),
                     [](const TaskInput& input) { return std::holds_alternative<Digest>(input.source); });
}

std::string SerializeOutputs(const TaskOutputs& outputs) {
  FieldWriter writer;
  writer.Put(static_cast<uint32_t>(outputs.size()));
  for (const TaskOutput& output : outputs) {
    writer.PutString(output.name);
    writer.PutDigest(output.digest);
    writer.Put(static_cast<uint64_t>(output.size_bytes));
  }
  return std::move(writer).bytes();
}

absl::StatusOr<TaskOutputs> ParseOutputs(std::string_view bytes) {
  FieldReader reader(bytes);
  const uint32_t count = reader.Get<uint32_t>();
  if (count > kMaxTaskOutputs || count > reader.remaining() / kMinOutputBytes) {
    return absl::DataLossError("task outputs: impossible count");
  }
  TaskOutputs outputs(count);
  for (TaskOutput& output : outputs) {
    output.name = reader.GetString();
    output.digest = reader.GetDigest();
    output.size_bytes = static_cast<int64_t>(reader.Get<uint64_t>());
  }
  BAKEWELL_RETURN_IF_ERROR(reader.Finish("task outputs"));
  return outputs;
}

bool IsPlainName(std::string_view name) {
  if (name.empty() || name.size() > kMaxNameBytes || name.front() == '.') return false;
  return std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '.' ||
           c == '-';
  });
}

bool IsPlainPath(std::string_view path) {
  for (int depth = 0; depth < 4; ++depth) {
    const size_t slash = path.find('/');
    if (!IsPlainName(path.substr(0, slash))) return false;
    if (slash == std::string_view::npos) return true;
    path.remove_prefix(slash + 1);
  }
  return false;
}

}  // namespace bakewell
