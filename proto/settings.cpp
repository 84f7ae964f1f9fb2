#include "proto/settings.h"

#include <absl/strings/str_cat.h>
#include <google/protobuf/util/json_util.h>

#include <span>

#include "core/base/check.h"
#include "core/base/sha256.h"
#include "proto/bakewell/v1/settings.pb.h"

namespace bakewell {
namespace {

using Colour = google::protobuf::RepeatedField<float>;

v1::BakeSettings::UvMode ProtoUv(UvMode uv) {
  switch (uv) {
    case UvMode::kKeep:
      return v1::BakeSettings::KEEP;
    case UvMode::kGenerate:
      return v1::BakeSettings::GENERATE;
    case UvMode::kAuto:
      break;
  }
  return v1::BakeSettings::AUTO;
}

v1::BakeSettings::Backfaces ProtoBackfaces(BackfaceMode backfaces) {
  switch (backfaces) {
    case BackfaceMode::kAbsorb:
      return v1::BakeSettings::ABSORB;
    case BackfaceMode::kPass:
      return v1::BakeSettings::PASS;
    case BackfaceMode::kReflect:
      break;
  }
  return v1::BakeSettings::REFLECT;
}

v1::BakeSettings::Quality ProtoQuality(Quality quality) {
  switch (quality) {
    case Quality::kPreview:
      return v1::BakeSettings::PREVIEW;
    case Quality::kHigh:
      return v1::BakeSettings::HIGH;
    case Quality::kMedium:
      break;
  }
  return v1::BakeSettings::MEDIUM;
}

UvMode UvOf(v1::BakeSettings::UvMode uv) {
  if (uv == v1::BakeSettings::KEEP) return UvMode::kKeep;
  return uv == v1::BakeSettings::GENERATE ? UvMode::kGenerate : UvMode::kAuto;
}

BackfaceMode BackfacesOf(v1::BakeSettings::Backfaces backfaces) {
  if (backfaces == v1::BakeSettings::ABSORB) return BackfaceMode::kAbsorb;
  return backfaces == v1::BakeSettings::PASS ? BackfaceMode::kPass : BackfaceMode::kReflect;
}

Quality QualityOf(v1::BakeSettings::Quality quality) {
  if (quality == v1::BakeSettings::PREVIEW) return Quality::kPreview;
  return quality == v1::BakeSettings::HIGH ? Quality::kHigh : Quality::kMedium;
}

// The fields of the message are called as the kinds are.
const google::protobuf::FieldDescriptor* SkipField(Skip skip) {
  return v1::Skip::descriptor()->FindFieldByName(kSkipNames[static_cast<size_t>(skip)]);
}

v1::Skip ProtoSkip(const SkipSet& off) {
  v1::Skip message;
  for (size_t i = 0; i < kSkipNames.size(); ++i) {
    const auto skip = static_cast<Skip>(i);
    message.GetReflection()->SetBool(&message, SkipField(skip), !off.Has(skip));
  }
  return message;
}

SkipSet SkipOf(const v1::Skip& message) {
  SkipSet off;
  for (size_t i = 0; i < kSkipNames.size(); ++i) {
    const auto skip = static_cast<Skip>(i);
    const auto* const field = SkipField(skip);
    const auto* const reflection = message.GetReflection();
    if (reflection->HasField(message, field) && !reflection->GetBool(message, field)) off.Add(skip);
  }
  return off;
}

Colour ProtoColour(const Rgb& rgb) {
  const float values[] = {rgb.x, rgb.y, rgb.z};
  return Colour(std::begin(values), std::end(values));
}

absl::StatusOr<Rgb> ColourOf(const char* name, const Colour& colour) {
  if (colour.size() == 3) return Rgb{colour[0], colour[1], colour[2]};
  return absl::InvalidArgumentError(
      absl::StrCat("environment.", name, " needs three numbers R, G, B, not ", colour.size()));
}

v1::Environment ProtoEnvironment(const Environment& environment) {
  v1::Environment message;
  switch (environment.type) {
    case EnvironmentType::kNone:
      message.mutable_none();
      break;
    case EnvironmentType::kConstant:
      *message.mutable_constant()->mutable_radiance() = ProtoColour(environment.radiance);
      break;
    case EnvironmentType::kGradient:
      *message.mutable_gradient()->mutable_zenith() = ProtoColour(environment.zenith);
      *message.mutable_gradient()->mutable_horizon() = ProtoColour(environment.horizon);
      *message.mutable_gradient()->mutable_ground() = ProtoColour(environment.ground);
      break;
    case EnvironmentType::kLatLong:
      message.mutable_lat_long()->set_width(environment.width);
      message.mutable_lat_long()->set_height(environment.height);
      message.mutable_lat_long()->set_sha256(Sha256Of(std::as_bytes(std::span(environment.latlong))).Hex());
      break;
  }
  return message;
}

absl::StatusOr<Environment> GradientOf(const v1::Environment::Gradient& gradient) {
  Environment environment;
  environment.type = EnvironmentType::kGradient;
  BAKEWELL_ASSIGN_OR_RETURN(environment.zenith, ColourOf("zenith", gradient.zenith()));
  BAKEWELL_ASSIGN_OR_RETURN(environment.horizon, ColourOf("horizon", gradient.horizon()));
  BAKEWELL_ASSIGN_OR_RETURN(environment.ground, ColourOf("ground", gradient.ground()));
  return environment;
}

absl::StatusOr<Environment> EnvironmentOf(const v1::Environment& message, const LatLongReader& read_latlong) {
  Environment environment;
  switch (message.kind_case()) {
    case v1::Environment::kConstant: {
      environment.type = EnvironmentType::kConstant;
      BAKEWELL_ASSIGN_OR_RETURN(environment.radiance, ColourOf("radiance", message.constant().radiance()));
      return environment;
    }
    case v1::Environment::kGradient:
      return GradientOf(message.gradient());
    case v1::Environment::kLatLong:
      if (!message.lat_long().file().empty()) return read_latlong(message.lat_long().file());
      return absl::InvalidArgumentError("environment.lat_long.file is missing: a digest alone names no picture here");
    case v1::Environment::kNone:
      return environment;
    case v1::Environment::KIND_NOT_SET:
      break;
  }
  return absl::InvalidArgumentError("environment needs one of none, constant, gradient, lat_long");
}

}  // namespace

v1::BakeSettings ProtoFromSettings(const BakeSettings& settings) {
  v1::BakeSettings message;
  message.set_uv(ProtoUv(settings.uv));
  message.set_density(settings.density == DensityMode::kSignal ? v1::BakeSettings::SIGNAL : v1::BakeSettings::UNIFORM);
  message.set_resolution(settings.resolution);
  message.set_texels_per_metre(settings.texels_per_metre);
  message.set_backfaces(ProtoBackfaces(settings.backfaces));
  message.set_quality(ProtoQuality(settings.quality));
  message.set_target_error(settings.target_error);
  message.set_min_samples(settings.min_samples);
  message.set_max_samples(settings.max_samples);
  message.set_photons(settings.photons);
  message.set_photon_batches(settings.photon_batches);
  message.set_albedo_limit(settings.albedo_limit);
  message.set_footprint(settings.footprint);
  message.set_filter(settings.filter);
  message.set_seed(settings.seed);
  *message.mutable_skip() = ProtoSkip(settings.no_skip);
  if (settings.environment) *message.mutable_environment() = ProtoEnvironment(*settings.environment);
  return message;
}

absl::StatusOr<BakeSettings> SettingsFromProto(const v1::BakeSettings& message, const LatLongReader& read_latlong) {
  BakeSettings settings;
  settings.uv = UvOf(message.uv());
  settings.density = message.density() == v1::BakeSettings::SIGNAL ? DensityMode::kSignal : DensityMode::kUniform;
  settings.resolution = message.resolution();
  settings.texels_per_metre = message.texels_per_metre();
  settings.backfaces = BackfacesOf(message.backfaces());
  settings.quality = QualityOf(message.quality());
  settings.target_error = message.target_error();
  settings.min_samples = message.min_samples();
  settings.max_samples = message.max_samples();
  settings.photons = message.photons();
  if (message.has_photon_batches()) settings.photon_batches = message.photon_batches();
  if (message.has_albedo_limit()) settings.albedo_limit = message.albedo_limit();
  if (message.has_footprint()) settings.footprint = message.footprint();
  if (message.has_filter()) settings.filter = message.filter();
  settings.seed = message.seed();
  settings.no_skip = SkipOf(message.skip());
  if (message.has_environment()) {
    BAKEWELL_ASSIGN_OR_RETURN(settings.environment, EnvironmentOf(message.environment(), read_latlong));
  }
  BAKEWELL_RETURN_IF_ERROR(ValidateSettings(settings));
  return settings;
}

std::string SettingsJson(const BakeSettings& settings) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  std::string json;
  const auto status = google::protobuf::util::MessageToJsonString(ProtoFromSettings(settings), &json, options);
  BAKEWELL_CHECK(status.ok());
  return json;
}

absl::StatusOr<BakeSettings> SettingsFromJson(std::string_view json, const LatLongReader& read_latlong) {
  v1::BakeSettings message;
  const auto status = google::protobuf::util::JsonStringToMessage(std::string(json), &message);
  if (!status.ok()) return absl::InvalidArgumentError(absl::StrCat("settings: ", status.message().ToString()));
  return SettingsFromProto(message, read_latlong);
}

}  // namespace bakewell
