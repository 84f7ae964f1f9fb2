#include "core/atlas/serialize.h"

#include <bit>

#include "core/base/fields.h"

namespace bakewell {

namespace {

constexpr uint32_t kFormat = 0x4c415742;  // "BWAL"

void PutInt(int32_t value, FieldWriter& writer) { writer.Put(static_cast<uint32_t>(value)); }
int32_t GetInt(FieldReader& reader) { return static_cast<int32_t>(reader.Get<uint32_t>()); }
void PutFloat(float value, FieldWriter& writer) { writer.Put(std::bit_cast<uint32_t>(value)); }
float GetFloat(FieldReader& reader) { return std::bit_cast<float>(reader.Get<uint32_t>()); }

// A vector with its length in front; `put` and `get` do one element, of at least four bytes.
template <typename T, typename Put>
void PutAll(const std::vector<T>& values, FieldWriter& writer, Put put) {
  writer.Put(static_cast<uint32_t>(values.size()));
  for (const T& value : values) put(value);
}
template <typename T, typename Get>
void GetAll(std::vector<T>& values, FieldReader& reader, Get get) {
  const uint32_t count = reader.Get<uint32_t>();
  values.reserve(std::min<size_t>(count, reader.remaining() / 4));
  for (uint32_t i = 0; i < count && reader.ok(); ++i) values.push_back(get());
}

void PutObject(const ObjectCharts& object, FieldWriter& writer) {
  PutAll(object.xref, writer, [&](uint32_t v) { writer.Put(v); });
  PutAll(object.uv, writer, [&](TexelUv uv) {
    PutFloat(uv.x, writer);
    PutFloat(uv.y, writer);
  });
  PutAll(object.index, writer, [&](uint32_t v) { writer.Put(v); });
  PutAll(object.chart_of_triangle, writer, [&](int32_t v) { PutInt(v, writer); });
}

ObjectCharts GetObject(FieldReader& reader) {
  ObjectCharts object;
  GetAll(object.xref, reader, [&] { return reader.Get<uint32_t>(); });
  GetAll(object.uv, reader, [&] {
    const float x = GetFloat(reader);
    return TexelUv{x, GetFloat(reader)};
  });
  GetAll(object.index, reader, [&] { return reader.Get<uint32_t>(); });
  GetAll(object.chart_of_triangle, reader, [&] { return GetInt(reader); });
  return object;
}

}  // namespace

std::string SerializeLayout(const AtlasLayout& layout) {
  FieldWriter writer;
  writer.Put(kFormat);
  PutAll(layout.pages, writer, [&](PageSize page) {
    PutInt(page.width, writer);
    PutInt(page.height, writer);
  });
  PutAll(layout.charts, writer, [&](const Chart& chart) {
    PutInt(chart.page, writer);
    PutInt(chart.object, writer);
  });
  PutAll(layout.objects, writer, [&](const ObjectCharts& object) { PutObject(object, writer); });
  PutFloat(layout.texels_per_metre, writer);
  return std::move(writer).bytes();
}

absl::StatusOr<AtlasLayout> ParseLayout(std::string_view bytes) {
  FieldReader reader(bytes);
  AtlasLayout layout;
  if (reader.Get<uint32_t>() != kFormat) return absl::DataLossError("atlas layout: not one");
  GetAll(layout.pages, reader, [&] {
    const int32_t width = GetInt(reader);
    return PageSize{width, GetInt(reader)};
  });
  GetAll(layout.charts, reader, [&] {
    const int32_t page = GetInt(reader);
    return Chart{page, GetInt(reader)};
  });
  GetAll(layout.objects, reader, [&] { return GetObject(reader); });
  layout.texels_per_metre = GetFloat(reader);
  BAKEWELL_RETURN_IF_ERROR(reader.Finish("atlas layout"));
  return layout;
}

}  // namespace bakewell
