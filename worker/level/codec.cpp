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
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(T));
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

// Nothing but floats, in the order in which they are declared: their bytes are those of the numbers one by one.
static_assert(sizeof(Rgb) == 3 * sizeof(float) && sizeof(RadianceSh) == 27 * sizeof(float) &&
              sizeof(LightPart) == 33 * sizeof(float));

void PutTexel(const TexelLight& light, NumberWriter& writer) {
  writer.Put(light.irradiance);
  writer.Put(light.sh);
  writer.Put(light.variance);
  writer.Put(light.indirect);
  writer.Put(light.direct_variance);
  for (const float noise : light.photon_noise) writer.Put(noise);
  writer.Put(light.backface_share);
  writer.Put(static_cast<uint8_t>(light.valid));
  writer.Put(light.open);
  writer.Put(static_cast<uint32_t>(light.direct_samples));
  writer.Put(static_cast<uint32_t>(light.indirect_samples));
}

void GetTexel(NumberReader& reader, TexelLight& light) {
  light.irradiance = reader.Get<Rgb>();
  light.sh = reader.Get<RadianceSh>();
  light.variance = reader.Get<Rgb>();
  light.indirect = reader.Get<LightPart>();
  light.direct_variance = reader.Get<Rgb>();
  for (float& noise : light.photon_noise) noise = reader.Get<float>();
  light.backface_share = reader.Get<float>();
  light.valid = reader.Get<uint8_t>() != 0;
  light.open = reader.Get<uint8_t>();
  light.direct_samples = static_cast<int>(reader.Get<uint32_t>());
  light.indirect_samples = static_cast<int>(reader.Get<uint32_t>());
}

constexpr size_t kTexelBytes = 4 * (2 * (3 + 27 + 3) + 3 + 2 + 1) + 2 + 8;
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

std::string SerializeTiles(std::span<const GatheredTiles> parts) {
  GatherCounters all;
  size_t texels = 0;
  for (const auto& [lights, counters] : parts) {
    texels += lights.size();
    all.Add(counters);
  }
  NumberWriter writer(kHeadBytes + kTexelBytes * texels);
  for (const int64_t value :
       {all.gather_rays, all.shadow_rays, all.bounce_rays, all.validity_rays, all.filter_rays, all.bad_samples}) {
    Put(value, writer);
  }
  writer.PutString(Serialize(all.skip));
  writer.Put(static_cast<uint64_t>(texels));
  for (const GatheredTiles& part : parts) {
    for (const TexelLight& light : part.lights) PutTexel(light, writer);
  }
  return std::move(writer).bytes();
}

absl::StatusOr<GatherCounters> ParseTiles(std::string_view bytes, std::vector<TexelLight>& lights) {
  NumberReader reader(bytes);
  GatherCounters counters;
  for (int64_t* value : {&counters.gather_rays, &counters.shadow_rays, &counters.bounce_rays, &counters.validity_rays,
                         &counters.filter_rays, &counters.bad_samples}) {
    Get(reader, *value);
  }
  BAKEWELL_ASSIGN_OR_RETURN(counters.skip, ParseSkipTally(reader.Take(reader.Get<uint32_t>())));
  const uint64_t count = reader.Get<uint64_t>();
  if (count > reader.remaining() / kTexelBytes) return absl::DataLossError("gathered tiles: impossible count");
  for (uint64_t i = 0; i < count; ++i) GetTexel(reader, lights.emplace_back());
  BAKEWELL_RETURN_IF_ERROR(reader.Finish("gathered tiles"));
  return counters;
}

}  // namespace bakewell
