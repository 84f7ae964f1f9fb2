#include "core/artifact/manifest.h"

#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "core/artifact/atomic_file.h"

namespace bakewell {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kFormatVersion = 2;

Json FilesJson(const std::vector<ManifestFile>& files) {
  Json array = Json::array();
  for (const ManifestFile& file : files) {
    array.push_back(
        {{"name", file.name}, {"kind", file.kind}, {"size_bytes", file.size_bytes}, {"sha256", file.sha256.Hex()}});
  }
  return array;
}

// "skip/KIND/NUMBER" among the counters, as an object for each kind.
constexpr std::string_view kSkipPrefix = "skip/";
Json SkipJson(const std::map<std::string, int64_t>& counters) {
  Json skip = Json::object();
  for (const auto& [name, count] : counters) {
    const size_t last = name.rfind('/');
    if (!name.starts_with(kSkipPrefix) || last < kSkipPrefix.size()) continue;
    Json& kind = skip[name.substr(kSkipPrefix.size(), last - kSkipPrefix.size())];
    const std::string number = name.substr(last + 1);
    kind[number] = number == "enabled" ? Json(count != 0) : Json(count);
  }
  return skip;
}

Json CountersJson(const std::map<std::string, int64_t>& counters) {
  Json json = Json::object();
  for (const auto& [name, count] : counters) {
    if (!name.starts_with(kSkipPrefix)) json[name] = count;
  }
  return json;
}

Json StatisticsJson(const Manifest& manifest) {
  return {{"rays", manifest.rays},
          {"photons", manifest.photons},
          {"estimated_error", manifest.estimated_error},
          {"counters", CountersJson(manifest.counters)},
          {"skip", SkipJson(manifest.counters)}};
}

}  // namespace

std::string ProgramVersion() { return BAKEWELL_VERSION; }

absl::StatusOr<ManifestFile> DescribeFile(const std::filesystem::path& path, std::string kind) {
  BAKEWELL_ASSIGN_OR_RETURN(const std::string bytes, ReadWholeFile(path));
  return ManifestFile{path.filename().string(), std::move(kind), bytes.size(),
                      Sha256Of(std::as_bytes(std::span(bytes)))};
}

absl::StatusOr<std::string> ManifestJson(const Manifest& manifest) {
  const Json settings = Json::parse(manifest.settings_json, nullptr, false);
  if (!settings.is_object()) return absl::InvalidArgumentError("the manifest's settings are not a JSON object");
  const Json json = {{"format", kFormatVersion},
                     {"program", manifest.program},
                     {"version", manifest.version},
                     {"task_versions", manifest.task_versions.empty() ? Json::object() : Json(manifest.task_versions)},
                     {"scene", {{"file", manifest.scene_file}, {"sha256", manifest.scene_digest.Hex()}}},
                     {"settings", settings},
                     {"statistics", StatisticsJson(manifest)},
                     {"warnings", manifest.warnings},
                     {"files", FilesJson(manifest.files)}};
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

absl::Status WriteManifest(const std::filesystem::path& folder, const Manifest& manifest) {
  BAKEWELL_ASSIGN_OR_RETURN(const std::string json, ManifestJson(manifest));
  return WriteFileAtomically(folder / "manifest.json", json);
}

}  // namespace bakewell
