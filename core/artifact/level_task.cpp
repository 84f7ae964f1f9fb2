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
  writer.Put(uint32_t{survey.has_cache});
  writer.Put(survey.overlapping_texels);
  for (const int64_t count : {survey.opaque_alpha.skipped, survey.opaque_alpha.of}) {
    writer.Put(static_cast<uint64_t>(count));
  }
  PutAll(survey.texels_of_tile, writer);
  PutAll(survey.tile_end_of_page, writer);
  return std::move(writer).bytes();
}

absl::StatusOr<Survey> ParseSurvey(std::string_view bytes) {
  FieldReader reader(bytes);
  Survey survey;
  survey.texels = reader.Get<uint64_t>();
  survey.photons = reader.Get<uint64_t>();
  survey.has_cache = reader.Get<uint32_t>() != 0;
  survey.overlapping_texels = reader.Get<uint64_t>();
  for (int64_t* count : {&survey.opaque_alpha.skipped, &survey.opaque_alpha.of}) {
    *count = static_cast<int64_t>(reader.Get<uint64_t>());
  }
  survey.texels_of_tile = GetAll(reader);
  survey.tile_end_of_page = GetAll(reader);
  BAKEWELL_RETURN_IF_ERROR(reader.Finish("texel survey"));
  return survey;
}

std::string Serialize(const PhotonCounts& counts) {
  FieldWriter writer;
  for (const int64_t count : {counts.photons, counts.photon_rays, counts.density_rays, counts.cells,
                              counts.unfaced_backs.skipped, counts.unfaced_backs.of, counts.unfaced_backs.saved}) {
    writer.Put(static_cast<uint64_t>(count));
  }
  return std::move(writer).bytes();
}

absl::StatusOr<PhotonCounts> ParsePhotonCounts(std::string_view bytes) {
  FieldReader reader(bytes);
  PhotonCounts counts;
  for (int64_t* count : {&counts.photons, &counts.photon_rays, &counts.density_rays, &counts.cells,
                         &counts.unfaced_backs.skipped, &counts.unfaced_backs.of, &counts.unfaced_backs.saved}) {
    *count = static_cast<int64_t>(reader.Get<uint64_t>());
  }
  BAKEWELL_RETURN_IF_ERROR(reader.Finish("photon counts"));
  return counts;
}

}  // namespace bakewell::level_task
