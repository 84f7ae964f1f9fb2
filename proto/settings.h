#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "core/artifact/settings.h"
#include "core/base/status.h"

namespace bakewell {

namespace v1 {
class BakeSettings;
}

// Reads the latitude-longitude picture that a message names.
using LatLongReader = std::function<absl::StatusOr<Environment>(const std::string& file)>;

// Every field is set, also those that have their default value. A picture is named by size and digest.
v1::BakeSettings ProtoFromSettings(const BakeSettings& settings);

// Absent fields get the defaults of core/artifact/settings.h; the result has passed ValidateSettings().
// kInvalidArgument: a value outside its range, a colour without three numbers, a picture without a file.
absl::StatusOr<BakeSettings> SettingsFromProto(const v1::BakeSettings& message, const LatLongReader& read_latlong);

// The message's JSON form, names as in settings.proto, one line: same text for same settings.
std::string SettingsJson(const BakeSettings& settings);

// As SettingsFromProto; also kInvalidArgument where the text is not JSON or has a member that the message has not.
absl::StatusOr<BakeSettings> SettingsFromJson(std::string_view json, const LatLongReader& read_latlong);

}  // namespace bakewell
