#include "core/artifact/settings.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>

namespace bakewell {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

TEST(ValidateSettings, DefaultsAreValid) { EXPECT_TRUE(ValidateSettings(BakeSettings()).ok()); }

TEST(ValidateSettings, EachSettingOutsideItsRangeIsNamed) {
  const auto message = [](auto change) {
    BakeSettings settings;
    change(settings);
    const absl::Status status = ValidateSettings(settings);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    return std::string(status.message());
  };
  EXPECT_EQ(message([](BakeSettings& s) { s.resolution = -1; }), "resolution must be 4 to 16384 texels, or 0, not -1");
  EXPECT_EQ(message([](BakeSettings& s) { s.texels_per_metre = kNan; }),
            "texels_per_metre must be above 0 and at most 10000, or 0, not nan");
  EXPECT_EQ(message([](BakeSettings& s) { s.target_error = 1; }),
            "target_error must be a relative error below 1, or 0, not 1");
  EXPECT_EQ(message([](BakeSettings& s) { s.density = DensityMode::kSignal, s.uv = UvMode::kKeep; }),
            "density must be uniform where uv is keep: only generated charts can change");
  EXPECT_EQ(message([](BakeSettings& s) { s.max_samples = 100; }),
            "max_samples must be a power of two up to 1048576, or 0, not 100");
  EXPECT_EQ(message([](BakeSettings& s) { s.min_samples = 64, s.max_samples = 32; }),
            "min_samples must be at most max_samples, not 64");
  EXPECT_EQ(message([](BakeSettings& s) { s.photons = -5; }), "photons must be 0 to 2^40, not -5");
  EXPECT_EQ(message([](BakeSettings& s) { s.photon_batches = 0; }), "photon_batches must be 1 to 65536, not 0");
  EXPECT_EQ(message([](BakeSettings& s) { s.albedo_limit = 1.5f; }),
            "albedo_limit must be above 0 and at most 1, not 1.5");
}

TEST(ValidateSettings, ABadEnvironmentPixelIsLocated) {
  BakeSettings settings;
  Environment& environment = settings.environment.emplace();
  environment.type = EnvironmentType::kLatLong;
  environment.width = environment.height = 2;
  environment.latlong = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, kNan, 1}};
  EXPECT_EQ(ValidateSettings(settings).message(), "environment pixel (1, 1) is negative, not finite or above 1e+15");
}

}  // namespace
}  // namespace bakewell
