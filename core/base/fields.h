#pragma once

#include <concepts>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "core/base/sha256.h"
#include "core/base/status.h"

namespace bakewell {

// Appends little-endian integers, length-prefixed strings and digests to a string: the canonical form that keys are
// hashed from and database columns hold. One way to write a value, so equal values have equal bytes.
class FieldWriter {
 public:
  template <std::unsigned_integral T>
  void Put(T value) {
    char bytes[sizeof(T)];
    for (size_t i = 0; i < sizeof(T); ++i) bytes[i] = static_cast<char>((value >> (8 * i)) & 0xff);
    bytes_.append(bytes, sizeof(T));
  }
  // 32-bit length, then the bytes.
  void PutString(std::string_view text);
  void PutDigest(const Digest& digest);
  const std::string& bytes() const& { return bytes_; }
  std::string bytes() && { return std::move(bytes_); }

 private:
  std::string bytes_;
};

// Reads what FieldWriter wrote. Safe on hostile bytes: after a read past the end every value is zero or empty and ok()
// stays false, so a decoder checks once, and checks counts against remaining() before it allocates. Borrows the bytes.
class FieldReader {
 public:
  explicit FieldReader(std::string_view bytes) : bytes_(bytes) {}
  template <std::unsigned_integral T>
  T Get() {
    const std::string_view part = Take(sizeof(T));
    T value = 0;
    for (size_t i = 0; i < part.size(); ++i)
      value |= static_cast<T>(static_cast<T>(static_cast<uint8_t>(part[i])) << (8 * i));
    return value;
  }
  std::string GetString();
  Digest GetDigest();
  size_t remaining() const { return bytes_.size(); }
  bool ok() const { return ok_; }
  // kDataLoss, naming `what`, unless every read was inside the bytes and none are left.
  absl::Status Finish(std::string_view what) const;

 private:
  std::string_view Take(size_t size_bytes);

  std::string_view bytes_;
  bool ok_ = true;
};

// The digest of 64 hexadecimal digits; kInvalidArgument for anything else.
absl::StatusOr<Digest> DigestFromHex(std::string_view hex);

// The 32 raw bytes, and back; kInvalidArgument for another length.
std::string DigestToBytes(const Digest& digest);
absl::StatusOr<Digest> DigestFromBytes(std::string_view bytes);

// SHA-256 of a string's bytes.
Digest Sha256Of(std::string_view text);

// For hash tables: a digest is already uniformly distributed.
struct DigestHash {
  size_t operator()(const Digest& digest) const;
};

}  // namespace bakewell
