#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/math/vec.h"

namespace bakewell {

static_assert(std::endian::native == std::endian::little, "scene bytes are little-endian and copied as they are");

// Appends plain values (numbers, and structs of 4-byte or of 8-byte numbers, which have no padding), little-endian.
class ByteWriter {
 public:
  template <typename T>
  void Put(const T& value) {
    PutArray(std::span<const T>(&value, 1));
  }
  template <typename T>
  void PutArray(std::span<const T> values) {
    static_assert(std::is_trivially_copyable_v<T>);
    Append(std::as_bytes(values));
  }
  // A 64-bit count, then the values.
  template <typename T>
  void PutVector(const std::vector<T>& values) {
    Put(static_cast<uint64_t>(values.size()));
    PutArray(std::span<const T>(values));
  }
  void PutString(const std::string& text);

  const std::vector<std::byte>& bytes() const { return bytes_; }
  std::vector<std::byte> Take() { return std::move(bytes_); }

 private:
  void Append(std::span<const std::byte> bytes);
  std::vector<std::byte> bytes_;
};

// Reads what ByteWriter wrote; safe on hostile bytes: nothing is allocated before the bytes for it are known to be
// there. The first failure sticks: every later read gives zero values and status() says where and why.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  template <typename T>
  T Get() {
    static_assert(std::is_trivially_copyable_v<T>);
    T value{};
    if (Require(1, sizeof(T))) std::memcpy(&value, Advance(sizeof(T)), sizeof(T));
    return value;
  }
  template <typename T>
  std::vector<T> GetVector() {
    const auto count = Get<uint64_t>();
    if (!Require(count, sizeof(T))) return {};
    std::vector<T> values(count);
    if (count > 0) std::memcpy(values.data(), Advance(count * sizeof(T)), count * sizeof(T));
    return values;
  }
  // A count of things that take at least `min_bytes` each, so that a loop over them ends.
  uint64_t GetCount(size_t min_bytes);
  std::string GetString();

  void Fail(const std::string& reason);
  bool ok() const { return status_.ok(); }
  const absl::Status& status() const { return status_; }
  size_t offset() const { return offset_; }
  bool AtEnd() const { return offset_ == bytes_.size(); }

 private:
  bool Require(uint64_t count, size_t size);
  const std::byte* Advance(size_t size);

  std::span<const std::byte> bytes_;
  size_t offset_ = 0;
  absl::Status status_;
};

}  // namespace bakewell
