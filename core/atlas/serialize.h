#pragma once

#include <string>
#include <string_view>

#include "core/atlas/layout.h"
#include "core/base/status.h"

namespace bakewell {

// A layout's bytes, the same for equal layouts; little endian.
std::string SerializeLayout(const AtlasLayout& layout);

// Safe on hostile bytes: kDataLoss for a truncated or malformed blob. Indices are not judged against a scene.
absl::StatusOr<AtlasLayout> ParseLayout(std::string_view bytes);

}  // namespace bakewell
