#include "worker/level/codec.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <bit>
#include <cstring>

namespace bakewell {

namespace {

// FieldReader for the millions of numbers of these blobs: the same bytes, inline. Numbers past the end are zero.
static_assert(std::endian::native == std::endian::little);
class NumberReader {
 public:
  explicit NumberReader(std::string_view bytes) : at_(bytes.data()), end_(bytes.data() + bytes.size()) {}
  template <typename T>
  T Get() {
    T value{};
    ok_ = ok_ && remaining() >= sizeof(T);
    if (!ok_) return value;
    std::memcpy(&value, at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  std::string_view Take(size_t bytes) {
    ok_ = ok_ && remaining() >= bytes;
    if (!ok_) return {};
    at_ += bytes;
    return {at_ - bytes, bytes};
  }
  size_t remaining() const { return static_cast<size_t>(end_ - at_); }
  bool ok() const { return ok_; }
  absl::Status Finish(const char* what) const {
    if (ok_ && at_ == end_) return absl::OkStatus();
    return absl::DataLossError(absl::StrCat(what, ok_ ? ": bytes left over at the end" : ": ends too early"));
  }

 private:
  const char* at_;
  const char* const end_;
  bool ok_ = true;
};

// FieldWriter for as many, with room for all of them from the start.
class NumberWriter {
 public:
  explicit NumberWriter(size_t expected_bytes) { bytes_.reserve(expected_bytes); }
  template <typename T>
  void Put(T value) {
    const size_t at = bytes_.size();
    bytes_.resize(at + sizeof(T));
    std::memcpy(bytes_.data() + at, &value, sizeof(T));
  }
  void PutString(std::string_view text) {
    Put(static_cast<uint32_t>(text.size()));
    bytes_ += text;
  }
  std::string bytes() && { return std::move(bytes_); }

 private:
  std::string bytes_;
};

void Put(float value, NumberWriter& writer) { writer.Put(value); }
void Put(int64_t value, NumberWriter& writer) { writer.Put(value); }
void Put(uint16_t value, NumberWriter& writer) { writer.Put(value); }
void Put(const Rgb& value, NumberWriter& writer) {
  for (const float channel : {value.x, value.y, value.z}) Put(channel, writer);
}
template <typename T, size_t kCount>
void Put(const std::array<T, kCount>& values, NumberWriter& writer) {
  for (const T& value : values) Put(value, writer);
}

void Get(NumberReader& reader, float& value) { value = reader.Get<float>(); }
void Get(NumberReader& reader, int64_t& value) { value = reader.Get<int64_t>(); }
void Get(NumberReader& reader, uint16_t& value) { value = reader.Get<uint16_t>(); }
void Get(NumberReader& reader, Rgb& value) {
  Get(reader, value.x);
  Get(reader, value.y);
  Get(reader, value.z);
}
template <typename T, size_t kCount>
void Get(NumberReader& reader, std::array<T, kCount>& values) {
  for (T& value : values) Get(reader, value);
}

template <typename T, size_t kCount>
void Add(const std::array<T, kCount>& from, std::array<T, kCount>& to) {
  for (size_t i = 0; i < kCount; ++i) to[i] += from[i];
}

void Put(const PhotonTotals& totals, NumberWriter& writer) {
  Put(totals.emitted, writer);
  Put(totals.absorbed, writer);
  Put(totals.escaped, writer);
  for (const int64_t value : {totals.rays, totals.deposits, totals.cut_paths}) Put(value, writer);
}

void AddTotals(NumberReader& reader, PhotonTotals& into) {
  PhotonTotals totals;
  Get(reader, totals.emitted);
  Get(reader, totals.absorbed);
  Get(reader, totals.escaped);
  for (int64_t* value : {&totals.rays, &totals.deposits, &totals.cut_paths}) Get(reader, *value);
  Add(totals.emitted, into.emitted);
  Add(totals.absorbed, into.absorbed);
  Add(totals.escaped, into.escaped);
  into.rays += totals.rays;
  into.deposits += totals.deposits;
  into.cut_paths += totals.cut_paths;
}

void PutTexel(const TexelLight& light, NumberWriter& writer) {
  Put(light.irradiance, writer);
  Put(light.sh.lambda, writer);
  Put(light.variance, writer);
  Put(light.indirect.irradiance, writer);
  Put(light.indirect.sh.lambda, writer);
  Put(light.indirect.variance, writer);
  Put(light.backface_share, writer);
  writer.Put(static_cast<uint8_t>(light.valid));
  writer.Put(light.open);
  writer.Put(static_cast<uint32_t>(light.direct_samples));
  writer.Put(static_cast<uint32_t>(light.indirect_samples));
}

TexelLight GetTexel(NumberReader& reader) {
  TexelLight light;
  Get(reader, light.irradiance);
  Get(reader, light.sh.lambda);
  Get(reader, light.variance);
  Get(reader, light.indirect.irradiance);
  Get(reader, light.indirect.sh.lambda);
  Get(reader, light.indirect.variance);
  Get(reader, light.backface_share);
  light.valid = reader.Get<uint8_t>() != 0;
  light.open = reader.Get<uint8_t>();
  light.direct_samples = static_cast<int>(reader.Get<uint32_t>());
  light.indirect_samples = static_cast<int>(reader.Get<uint32_t>());
  return light;
}

constexpr size_t kTexelBytes = 4 * (2 * (3 + 27 + 3) + 1) + 2 + 8;
constexpr size_t kCellBytes = sizeof(Rgb) + sizeof(CachedLight::group_share) + 1;
constexpr size_t kFluxBytes = 8 + 4 + sizeof(CellFlux::flux) + sizeof(CellFlux::group);
constexpr size_t kHeadBytes = 1024;  // what precedes the texels, cells or photons, about

}  // namespace

std::string SerializePhotons(const PhotonMap& map) {
  const auto hit = std::count_if(map.flux.begin(), map.flux.end(), [](const CellFlux& flux) { return flux.count > 0; });
  NumberWriter writer(kHeadBytes + kFluxBytes * static_cast<size_t>(hit));
  Put(map.totals, writer);
  writer.Put(static_cast<uint64_t>(map.flux.size()));
  for (size_t i = 0; i < map.flux.size(); ++i) {
    const CellFlux& flux = map.flux[i];
    if (flux.count == 0) continue;
    writer.Put(static_cast<uint64_t>(i));
    writer.Put(flux.count);
    Put(flux.flux, writer);
    Put(flux.group, writer);
  }
  return std::move(writer).bytes();
}

absl::Status AddPhotons(std::string_view bytes, PhotonMap& into) {
  NumberReader reader(bytes);
  AddTotals(reader, into.totals);
  if (reader.Get<uint64_t>() != into.flux.size()) return absl::DataLossError("photons: of other cells");
  while (reader.ok() && reader.remaining() > 0) {
    const uint64_t index = reader.Get<uint64_t>();
    CellFlux flux;
    flux.count = reader.Get<uint32_t>();
    Get(reader, flux.flux);
    Get(reader, flux.group);
    if (index >= into.flux.size()) return absl::DataLossError("photons: of a cell that is not there");
    CellFlux& sum = into.flux[index];
    sum.count += flux.count;
    Add(flux.flux, sum.flux);
    Add(flux.group, sum.group);
  }
  return reader.Finish("photons");
}

std::string SerializeCache(const RadianceCache& cache) {
  NumberWriter writer(kHeadBytes + kCellBytes * cache.light.size());
  Put(cache.photons_seen, writer);
  Put(cache.rays, writer);
  writer.Put(static_cast<uint64_t>(cache.light.size()));
  for (const CachedLight& light : cache.light) {
    Put(light.irradiance, writer);
    Put(light.group_share, writer);
    writer.Put(light.window);
  }
  return std::move(writer).bytes();
}

absl::StatusOr<RadianceCache> ParseCache(std::string_view bytes) {
  NumberReader reader(bytes);
  RadianceCache cache;
  Get(reader, cache.photons_seen);
  Get(reader, cache.rays);
  const uint64_t count = reader.Get<uint64_t>();
  if (count > reader.remaining() / kCellBytes) return absl::DataLossError("radiance cache: impossible count");
  cache.light.resize(count);
  for (CachedLight& light : cache.light) {
    Get(reader, light.irradiance);
    Get(reader, light.group_share);
    light.window = reader.Get<uint8_t>();
  }
  BAKEWELL_RETURN_IF_ERROR(reader.Finish("radiance cache"));
  return cache;
}

GatheredTiles Joined(std::span<const GatheredTiles> parts) {
  GatheredTiles all;
  size_t texels = 0;
  for (const GatheredTiles& part : parts) texels += part.lights.size();
  all.lights.reserve(texels);
  for (const GatheredTiles& part : parts) {
    all.lights.insert(all.lights.end(), part.lights.begin(), part.lights.end());
    all.counters.gather_rays += part.counters.gather_rays;
    all.counters.shadow_rays += part.counters.shadow_rays;
    all.counters.bounce_rays += part.counters.bounce_rays;
    all.counters.validity_rays += part.counters.validity_rays;
    all.counters.filter_rays += part.counters.filter_rays;
    all.counters.bad_samples += part.counters.bad_samples;
    all.counters.skip.Add(part.counters.skip);
  }
  return all;
}

std::string SerializeTiles(const GatheredTiles& tiles) {
  NumberWriter writer(kHeadBytes + kTexelBytes * tiles.lights.size());
  const GatherCounters& counters = tiles.counters;
  for (const int64_t value : {counters.gather_rays, counters.shadow_rays, counters.bounce_rays, counters.validity_rays,
                              counters.filter_rays, counters.bad_samples}) {
    Put(value, writer);
  }
  writer.PutString(Serialize(counters.skip));
  writer.Put(static_cast<uint64_t>(tiles.lights.size()));
  for (const TexelLight& light : tiles.lights) PutTexel(light, writer);
  return std::move(writer).bytes();
}

absl::StatusOr<GatheredTiles> ParseTiles(std::string_view bytes) {
  NumberReader reader(bytes);
  GatheredTiles tiles;
  GatherCounters& counters = tiles.counters;
  for (int64_t* value : {&counters.gather_rays, &counters.shadow_rays, &counters.bounce_rays, &counters.validity_rays,
                         &counters.filter_rays, &counters.bad_samples}) {
    Get(reader, *value);
  }
  BAKEWELL_ASSIGN_OR_RETURN(counters.skip, ParseSkipTally(reader.Take(reader.Get<uint32_t>())));
  const uint64_t count = reader.Get<uint64_t>();
  if (count > reader.remaining() / kTexelBytes) return absl::DataLossError("gathered tiles: impossible count");
  tiles.lights.reserve(count);
  for (uint64_t i = 0; i < count; ++i) tiles.lights.push_back(GetTexel(reader));
  BAKEWELL_RETURN_IF_ERROR(reader.Finish("gathered tiles"));
  return tiles;
}

}  // namespace bakewell
