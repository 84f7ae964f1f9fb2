#include "proto/settings.h"

#include <gtest/gtest.h>

#include "proto/bakewell/v1/settings.pb.h"

namespace bakewell {
namespace {

absl::StatusOr<Environment> NoPicture(const std::string& file) { return absl::NotFoundError(file); }

// Every field away from its default.
BakeSettings Unusual() {
  BakeSettings settings;
  settings.uv = UvMode::kGenerate;
  settings.density = DensityMode::kSignal;
  settings.resolution = 512;
  settings.texels_per_metre = 7.25f;
  settings.backfaces = BackfaceMode::kPass;
  settings.quality = Quality::kHigh;
  settings.target_error = 0.01f;
  settings.min_samples = 16;
  settings.max_samples = 4096;
  settings.photons = int64_t{5} << 32;
  settings.photon_batches = 64;
  settings.albedo_limit = 0.9f;
  settings.footprint = 0.75f;
  settings.seed = 0xffffffff;
  settings.no_skip.Add(Skip::kDarkCharts);
  Environment& environment = settings.environment.emplace();
  environment.type = EnvironmentType::kGradient;
  environment.zenith = {1, 2, 3};
  environment.horizon = {0.1f, 0.2f, 0.3f};
  environment.ground = {4, 5, 6};
  return settings;
}

TEST(Settings, JsonBringsEveryFieldBack) {
  const std::string json = SettingsJson(Unusual());
  const absl::StatusOr<BakeSettings> read = SettingsFromJson(json, NoPicture);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->uv, UvMode::kGenerate);
  EXPECT_EQ(read->albedo_limit, 0.9f);
  EXPECT_EQ(read->footprint, 0.75f);
  EXPECT_EQ(read->density, DensityMode::kSignal);
  EXPECT_EQ(read->photons, int64_t{5} << 32);
  EXPECT_EQ(read->no_skip, Unusual().no_skip);
  EXPECT_EQ(read->environment->horizon.y, 0.2f);
  EXPECT_EQ(SettingsJson(*read), json);  // and so all others
}

TEST(Settings, EveryFieldOfTheMessageIsWrittenAlsoAtItsDefault) {
  const v1::BakeSettings message = ProtoFromSettings(Unusual()), defaults = ProtoFromSettings(BakeSettings());
  const auto* const descriptor = v1::BakeSettings::descriptor();
  for (int i = 0; i < descriptor->field_count(); ++i) {
    const auto* const field = descriptor->field(i);
    EXPECT_TRUE(message.GetReflection()->HasField(message, field)) << field->name();
    const bool always = field->name() != "environment";
    EXPECT_EQ(defaults.GetReflection()->HasField(defaults, field), always) << field->name();
  }
}

TEST(Settings, AbsentFieldsHaveTheDefaultsOfTheStruct) {
  const absl::StatusOr<BakeSettings> read = SettingsFromJson("{}", NoPicture);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(SettingsJson(*read), SettingsJson(BakeSettings()));
  EXPECT_FALSE(read->environment.has_value());
}

TEST(Settings, EachEnvironmentComesBack) {
  for (const EnvironmentType type : {EnvironmentType::kNone, EnvironmentType::kConstant, EnvironmentType::kGradient}) {
    BakeSettings settings = Unusual();
    settings.environment->type = type;
    const absl::StatusOr<BakeSettings> read = SettingsFromJson(SettingsJson(settings), NoPicture);
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->environment->type, type);
  }
}

TEST(Settings, APictureIsReadByNameAndWrittenByDigest) {
  const auto two_pixels = [](const std::string& file) -> absl::StatusOr<Environment> {
    EXPECT_EQ(file, "sky.exr");
    Environment environment;
    environment.type = EnvironmentType::kLatLong;
    environment.width = 2, environment.height = 1;
    environment.latlong = {{1, 2, 3}, {4, 5, 6}};
    return environment;
  };
  const auto read = SettingsFromJson(R"({"environment":{"lat_long":{"file":"sky.exr"}}})", two_pixels);
  ASSERT_TRUE(read.ok()) << read.status();
  const v1::BakeSettings written = ProtoFromSettings(*read);
  EXPECT_EQ(written.environment().lat_long().width(), 2);
  EXPECT_EQ(written.environment().lat_long().sha256().size(), 64u);
  EXPECT_EQ(SettingsFromJson(SettingsJson(*read), two_pixels).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(Settings, BadTextIsTheUsersErrorAndNamed) {
  const auto message = [](const char* json) {
    const absl::Status status = SettingsFromJson(json, NoPicture).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << json;
    return std::string(status.message());
  };
  message("{");
  EXPECT_NE(message(R"({"qualty": "HIGH"})").find("qualty"), std::string::npos);
  EXPECT_NE(message(R"({"quality": "ULTRA"})").find("ULTRA"), std::string::npos);
  EXPECT_NE(message(R"({"max_samples": 3})").find("max_samples must be a power of two"), std::string::npos);
  EXPECT_NE(message(R"({"environment": {"constant": {"radiance": [1]}}})").find("three numbers"), std::string::npos);
  EXPECT_NE(message(R"({"environment": {}})").find("needs one of"), std::string::npos);
}

}  // namespace
}  // namespace bakewell
