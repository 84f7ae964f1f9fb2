#pragma once

#include <filesystem>
#include <string>

#include "core/base/status.h"
#include "core/scene/scene.h"

namespace bakewell {

// "none", "constant:R,G,B", "gradient:ZR,ZG,ZB/HR,HG,HB/GR,GG,GB" (zenith, horizon, ground) or the name of a
// latitude-longitude EXR. kInvalidArgument with the text and the forms that there are.
absl::StatusOr<Environment> ParseEnvironment(const std::string& text);

// A latitude-longitude EXR with channels R, G, B, in the orientation of core/scene/scene.h. Errors as ReadExr; also
// kInvalidArgument without those channels. ValidateSettings() looks at the pixels.
absl::StatusOr<Environment> ReadLatLong(const std::filesystem::path& path);

}  // namespace bakewell
