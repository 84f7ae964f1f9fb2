#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace bakewell {

// A SHA-256 digest, 32 bytes.
struct Digest {
  std::array<uint8_t, 32> bytes{};
  // 64 lower-case hexadecimal digits.
  std::string Hex() const;
  friend auto operator<=>(const Digest&, const Digest&) = default;
};

// Streaming SHA-256 (OpenSSL). Not thread safe; Finish() once.
class Sha256 {
 public:
  Sha256();
  ~Sha256();
  Sha256(const Sha256&) = delete;
  Sha256& operator=(const Sha256&) = delete;
  void Update(std::span<const std::byte> bytes);
  Digest Finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

Digest Sha256Of(std::span<const std::byte> bytes);

}  // namespace bakewell
