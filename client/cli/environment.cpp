#include "client/cli/environment.h"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <array>
#include <cmath>
#include <vector>

#include "core/image/exr.h"

namespace bakewell {
namespace {

absl::Status BadEnvironment(const std::string& text) {
  return absl::InvalidArgumentError(
      absl::StrCat("--environment ", text,
                   " is none of: none, constant:R,G,B, gradient:R,G,B/R,G,B/R,G,B (zenith/horizon/ground), FILE.exr; "
                   "radiances are finite and not negative"));
}

absl::StatusOr<Rgb> ParseRgb(const std::string& text) {
  const std::vector<std::string> parts = absl::StrSplit(text, ',');
  if (parts.size() != 3) return absl::InvalidArgumentError(text);
  std::array<float, 3> values{};
  for (size_t i = 0; i < 3; ++i) {
    const bool number = absl::SimpleAtof(parts[i], &values[i]) && std::isfinite(values[i]) && values[i] >= 0;
    if (!number) return absl::InvalidArgumentError(text);
  }
  return Rgb{values[0], values[1], values[2]};
}

absl::StatusOr<Environment> ParseConstant(const std::string& text) {
  Environment environment;
  environment.type = EnvironmentType::kConstant;
  BAKEWELL_ASSIGN_OR_RETURN(environment.radiance, ParseRgb(text));
  return environment;
}

absl::StatusOr<Environment> ParseGradient(const std::string& text) {
  const std::vector<std::string> parts = absl::StrSplit(text, '/');
  if (parts.size() != 3) return absl::InvalidArgumentError(text);
  Environment environment;
  environment.type = EnvironmentType::kGradient;
  BAKEWELL_ASSIGN_OR_RETURN(environment.zenith, ParseRgb(parts[0]));
  BAKEWELL_ASSIGN_OR_RETURN(environment.horizon, ParseRgb(parts[1]));
  BAKEWELL_ASSIGN_OR_RETURN(environment.ground, ParseRgb(parts[2]));
  return environment;
}

}  // namespace

absl::StatusOr<Environment> ParseEnvironment(const std::string& text) {
  if (text == "none") return Environment();
  if (std::filesystem::path(text).extension() == ".exr") return ReadLatLong(text);
  const size_t colon = text.find(':');
  const std::string kind = text.substr(0, colon);
  const std::string values = colon == std::string::npos ? std::string() : text.substr(colon + 1);
  absl::StatusOr<Environment> environment = absl::InvalidArgumentError(text);
  if (kind == "constant") environment = ParseConstant(values);
  if (kind == "gradient") environment = ParseGradient(values);
  return environment.ok() ? environment : BadEnvironment(text);
}

absl::StatusOr<Environment> ReadLatLong(const std::filesystem::path& path) {
  BAKEWELL_ASSIGN_OR_RETURN(const Image image, ReadExr(path));
  const int r = image.ChannelIndex("R"), g = image.ChannelIndex("G"), b = image.ChannelIndex("B");
  if (r < 0 || g < 0 || b < 0) {
    return absl::InvalidArgumentError(absl::StrCat(path.string(), " has no channels R, G and B"));
  }
  Environment environment;
  environment.type = EnvironmentType::kLatLong;
  environment.width = image.width;
  environment.height = image.height;
  for (size_t i = 0; i < image.PixelCount(); ++i) {
    environment.latlong.push_back({image.Channel(r)[i], image.Channel(g)[i], image.Channel(b)[i]});
  }
  return environment;
}

}  // namespace bakewell
