#include "client/local/bake.h"

#include <absl/strings/str_cat.h>
#include <tbb/global_control.h>

#include <condition_variable>
#include <thread>

#include "client/local/farm.h"
#include "client/local/level_bake.h"
#include "client/local/phase_clock.h"
#include "core/atlas/serialize.h"
#include "proto/bakewell/v1/settings.pb.h"
#include "proto/settings.h"

namespace bakewell {

namespace {

namespace fs = std::filesystem;

// A folder inside the staging folder, gone before that is looked at.
class FarmFolder {
 public:
  explicit FarmFolder(const OutputDir& out) : path_(out.Staging() / "farm") {}
  ~FarmFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  FarmFolder(const FarmFolder&) = delete;
  FarmFolder& operator=(const FarmFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  const fs::path path_;
};

// While it lives, cancels the job when the user wants that, or when the farm cannot go on.
class Canceller {
 public:
  Canceller(EmbeddedFarm& farm, int64_t job, const Progress& progress)
      : thread_([this, &farm, job, &progress](const std::stop_token& stop) { Watch(stop, farm, job, progress); }) {}
  // Why the farm could not go on.
  absl::Status Stop() {
    thread_.request_stop();
    thread_.join();
    return trouble_;
  }

 private:
  void Watch(const std::stop_token& stop, EmbeddedFarm& farm, int64_t job, const Progress& progress) {
    std::unique_lock lock(mutex_);
    while (!stop.stop_requested()) {
      trouble_ = farm.Trouble();
      if (!trouble_.ok()) return farm.client().StopWatching();
      if (progress.Cancelled()) {
        // The watch says how the job ended, unless it could not be cancelled.
        if (!farm.client().Cancel(job).ok()) farm.client().StopWatching();
        return;
      }
      // A signal handler can set a flag, and wake nobody.
      wake_.wait_for(lock, stop, std::chrono::milliseconds(200), [] { return false; });
    }
  }

  std::mutex mutex_;
  std::condition_variable_any wake_;
  absl::Status trouble_;
  std::jthread thread_;
};

// Bakes the submission on a farm of this process and fetches the result.
absl::StatusOr<Manifest> BakeEmbedded(const Submission& submission, int threads, const std::string& layout,
                                      const OutputDir& out, PhaseFollower& phases, const Progress& progress) {
  const FarmFolder folder(out);
  BAKEWELL_ASSIGN_OR_RETURN(const auto farm, EmbeddedFarm::Start(folder.path(), threads, layout, phases));
  BAKEWELL_ASSIGN_OR_RETURN(const v1::SubmitResponse submitted,
                            farm->client().Submit(submission.scene_bytes, {"", "", submission.settings_bytes, true}));
  Canceller canceller(*farm, submitted.job_id(), progress);
  const auto job = farm->client().Watch(submitted.job_id(), [](const v1::Job&) { return true; });
  BAKEWELL_RETURN_IF_ERROR(canceller.Stop());
  BAKEWELL_RETURN_IF_ERROR(job.status());
  BAKEWELL_RETURN_IF_ERROR(StatusOfEnded(*job, submission.scene_path));
  phases.Enter("write");
  farm->HandOver(*job, out.Staging());
  return FetchResult(farm->client(), *job, submission, out);
}

// Charts after a preview of the light, which a farm does not make; with what is to be said about them. SerializeLayout
// bytes.
absl::StatusOr<std::string> LayoutAfterSignal(Submission& submission, PhaseClock& clock, Progress& progress) {
  auto prepared = PrepareLevel(submission.level, submission.settings, clock, progress);
  if (!prepared.ok()) {
    return absl::Status(prepared.status().code(),
                        absl::StrCat(submission.scene_path.string(), ": ", prepared.status().message()));
  }
  submission.level.warnings = prepared->warnings;
  BakeSettings sent = submission.settings;
  sent.environment.reset();
  sent.density = DensityMode::kUniform;
  submission.settings_bytes = ProtoFromSettings(sent).SerializeAsString();
  return SerializeLayout(prepared->layout);
}

}  // namespace

int ThreadCount(int threads) {
  return threads > 0 ? threads : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
}

absl::StatusOr<BakeSummary> Bake(const BakeRequest& request, Progress& progress) {
  const double wall = PhaseClock::WallSeconds(), cpu = PhaseClock::CpuSeconds();
  const int threads = ThreadCount(request.threads);
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(threads));
  PhaseClock clock;
  PhaseFollower phases(progress, clock);
  phases.Enter("load");
  BAKEWELL_ASSIGN_OR_RETURN(Submission submission, MakeSubmission(request.scene_path, request.settings));
  BAKEWELL_ASSIGN_OR_RETURN(OutputDir out, OutputDir::Create(request.output_dir));
  std::string layout;
  if (request.settings.density == DensityMode::kSignal) {
    phases.End();
    BAKEWELL_ASSIGN_OR_RETURN(layout, LayoutAfterSignal(submission, clock, progress));
  }
  BAKEWELL_ASSIGN_OR_RETURN(const Manifest manifest, BakeEmbedded(submission, threads, layout, out, phases, progress));
  phases.End();
  if (progress.Cancelled()) return absl::CancelledError("cancelled");
  BAKEWELL_ASSIGN_OR_RETURN(BakeSummary summary, Conclude(out, request.output_dir, manifest));
  summary.phases = clock.phases();
  summary.peak_memory_bytes = PhaseClock::PeakMemoryBytes();
  summary.wall_seconds = PhaseClock::WallSeconds() - wall;
  summary.cpu_seconds = PhaseClock::CpuSeconds() - cpu;
  return summary;
}

}  // namespace bakewell
