#include "core/scene/byte_stream.h"

#include <absl/strings/str_cat.h>

namespace bakewell {

void ByteWriter::Append(std::span<const std::byte> bytes) {
  const size_t old_size = bytes_.size();
  bytes_.resize(old_size + bytes.size());
  if (!bytes.empty()) std::memcpy(bytes_.data() + old_size, bytes.data(), bytes.size());
}

void ByteWriter::PutString(const std::string& text) {
  Put(static_cast<uint64_t>(text.size()));
  PutArray(std::span<const char>(text));
}

uint64_t ByteReader::GetCount(size_t min_bytes) {
  const auto count = Get<uint64_t>();
  return Require(count, min_bytes) ? count : 0;
}

std::string ByteReader::GetString() {
  const auto size = Get<uint64_t>();
  if (!Require(size, 1)) return {};
  return {reinterpret_cast<const char*>(Advance(size)), size};
}

void ByteReader::Fail(const std::string& reason) {
  if (status_.ok()) status_ = absl::DataLossError(absl::StrCat("scene bytes at offset ", offset_, ": ", reason));
}

bool ByteReader::Require(uint64_t count, size_t size) {
  if (!ok()) return false;
  const size_t left = bytes_.size() - offset_;
  if (count <= left / size) return true;
  Fail(absl::StrCat(count, " values of ", size, " bytes are announced, ", left, " bytes are left"));
  return false;
}

const std::byte* ByteReader::Advance(size_t size) {
  const std::byte* at = bytes_.data() + offset_;
  offset_ += size;
  return at;
}

}  // namespace bakewell
