#include "core/base/fields.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cstring>

namespace bakewell {

void FieldWriter::PutString(std::string_view text) {
  Put(static_cast<uint32_t>(text.size()));
  bytes_.append(text);
}

void FieldWriter::PutDigest(const Digest& digest) { bytes_.append(DigestToBytes(digest)); }

std::string_view FieldReader::Take(size_t size_bytes) {
  if (size_bytes > bytes_.size()) {
    ok_ = false;
    bytes_ = {};
    return {};
  }
  const std::string_view part = bytes_.substr(0, size_bytes);
  bytes_.remove_prefix(size_bytes);
  return part;
}

std::string FieldReader::GetString() {
  const uint32_t size_bytes = Get<uint32_t>();
  return std::string(Take(size_bytes));
}

Digest FieldReader::GetDigest() {
  Digest digest;
  const std::string_view part = Take(digest.bytes.size());
  std::memcpy(digest.bytes.data(), part.data(), part.size());
  return digest;
}

absl::Status FieldReader::Finish(std::string_view what) const {
  if (ok_ && bytes_.empty()) return absl::OkStatus();
  return absl::DataLossError(absl::StrCat(absl::string_view(what.data(), what.size()),
                                          ok_ ? ": bytes left over at the end" : ": ends too early"));
}

namespace {

int HexValue(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

}  // namespace

absl::StatusOr<Digest> DigestFromHex(std::string_view hex) {
  Digest digest;
  const absl::Status refused = absl::InvalidArgumentError("a digest is 64 hexadecimal digits");
  if (hex.size() != 2 * digest.bytes.size()) return refused;
  for (size_t i = 0; i < digest.bytes.size(); ++i) {
    const int high = HexValue(hex[2 * i]), low = HexValue(hex[2 * i + 1]);
    if (high < 0 || low < 0) return refused;
    digest.bytes[i] = static_cast<uint8_t>(high * 16 + low);
  }
  return digest;
}

std::string DigestToBytes(const Digest& digest) {
  return std::string(reinterpret_cast<const char*>(digest.bytes.data()), digest.bytes.size());
}

absl::StatusOr<Digest> DigestFromBytes(std::string_view bytes) {
  Digest digest;
  if (bytes.size() != digest.bytes.size()) {
    return absl::InvalidArgumentError(absl::StrCat("a digest is 32 bytes, not ", bytes.size()));
  }
  std::copy(bytes.begin(), bytes.end(), digest.bytes.begin());
  return digest;
}

Digest Sha256Of(std::string_view text) { return Sha256Of(std::as_bytes(std::span(text))); }

size_t DigestHash::operator()(const Digest& digest) const {
  size_t value;
  std::memcpy(&value, digest.bytes.data(), sizeof(value));
  return value;
}

}  // namespace bakewell
