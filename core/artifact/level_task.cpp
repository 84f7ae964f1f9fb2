#include "core/artifact/level_task.h"

namespace bakewell::level_task {

namespace {

void PutAll(const std::vector<uint32_t>& values, FieldWriter& writer) {
  writer.Put(static_cast<uint32_t>(values.size()));
  for (const uint32_t value : values) writer.Put(value);
}

std::vector<uint32_t> GetAll(FieldReader& reader) {
  std::vector<uint32_t> values;
  for (uint32_t left = reader.Get<uint32_t>(); left > 0 && reader.ok(); --left)
    values.push_back(reader.Get<uint32_t>());
  return values;
}

}  // namespace

std::string Serialize(const Settings& settings) {
  FieldWriter writer;
  writer.PutString(settings.settings_json);
  writer.Put(settings.begin);
  writer.Put(settings.end);
  return std::move(writer).bytes();
}

absl::StatusOr<Settings> ParseSettings(std::string_view bytes) {
  FieldReader reader(bytes);
  Settings settings;
  settings.settings_json = reader.GetString();
  settings.begin = reader.Get<uint32_t>();
  settings.end = reader.Get<uint32_t>();
  BAKEWELL_RETURN_IF_ERROR(reader.Finish("task settings"));
  return settings;
}

std::string Serialize(const Survey& survey) {
  FieldWriter writer;
  writer.Put(survey.texels);
  writer.Put(survey.photons);
  PutAll(survey.texels_of_tile, writer);
  PutAll(survey.tile_end_of_page, writer);
  return std::move(writer).bytes();
}

absl::StatusOr<Survey> ParseSurvey(std::string_view bytes) {
  FieldReader reader(bytes);
  Survey survey;
  survey.texels = reader.Get<uint64_t>();
  survey.photons = reader.Get<uint64_t>();
  survey.texels_of_tile = GetAll(reader);
  survey.tile_end_of_page = GetAll(reader);
  BAKEWELL_RETURN_IF_ERROR(reader.Finish("texel survey"));
  return survey;
}

}  // namespace bakewell::level_task
