#include "core/artifact/bake_report.h"

#include <nlohmann/json.hpp>

namespace bakewell {
namespace {

using Json = nlohmann::ordered_json;

// Whether `json` has the member, of the type that `is` asks for.
bool Has(const Json& json, const char* name, bool (Json::*is)() const noexcept) {
  const auto member = json.find(name);
  return member != json.end() && ((*member).*is)();
}

bool AllAre(const Json& json, bool (Json::*is)() const noexcept) {
  return std::all_of(json.begin(), json.end(), [&](const Json& element) { return (element.*is)(); });
}

}  // namespace

std::string ReportJson(const BakeReport& report) {
  const Json json = {{"counters", report.counters.empty() ? Json::object() : Json(report.counters)},
                     {"rays", report.rays},
                     {"photons", report.photons},
                     {"estimated_error", report.estimated_error},
                     {"warnings", report.warnings}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

absl::StatusOr<BakeReport> ParseReport(std::string_view text) {
  const Json json = Json::parse(text, nullptr, false);
  const bool sound = json.is_object() && Has(json, "counters", &Json::is_object) &&
                     Has(json, "rays", &Json::is_number_integer) && Has(json, "photons", &Json::is_number_integer) &&
                     json.contains("estimated_error") && Has(json, "warnings", &Json::is_array) &&
                     AllAre(json["counters"], &Json::is_number_integer) && AllAre(json["warnings"], &Json::is_string);
  if (!sound) return absl::DataLossError("statistics.json is malformed");
  BakeReport report;
  for (const auto& [name, count] : json["counters"].items()) report.counters[name] = count.get<int64_t>();
  report.rays = json["rays"].get<int64_t>();
  report.photons = json["photons"].get<int64_t>();
  const Json& error = json["estimated_error"];  // null where it is not finite
  report.estimated_error = error.is_number() ? error.get<double>() : std::numeric_limits<double>::quiet_NaN();
  for (const Json& warning : json["warnings"]) report.warnings.push_back(warning.get<std::string>());
  return report;
}

}  // namespace bakewell
