#include "client/job/submission.h"

#include "core/scene/canonical.h"
#include "proto/bakewell/v1/settings.pb.h"
#include "proto/settings.h"

namespace bakewell {

absl::StatusOr<Submission> MakeSubmission(const std::filesystem::path& scene_path, const BakeSettings& settings) {
  Submission submission{scene_path, settings, {}, {}, {}};
  BAKEWELL_ASSIGN_OR_RETURN(submission.level, LoadLevel(scene_path));
  if (settings.environment) submission.level.scene.environment = *settings.environment;
  const std::vector<std::byte> bytes = SerializeScene(submission.level.scene);
  submission.scene_bytes.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  BakeSettings sent = settings;
  sent.environment.reset();
  submission.settings_bytes = ProtoFromSettings(sent).SerializeAsString();
  return submission;
}

}  // namespace bakewell
