// What /metrics and /status.json say.
#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>

#include <algorithm>

#include "core/artifact/json_line.h"
#include "core/artifact/level_task.h"
#include "server/http/dashboard.h"

namespace bakewell::http {

namespace {

void Metric(std::string& text, std::string_view name, std::string_view type, std::string_view help, double value) {
  const absl::string_view n(name.data(), name.size());
  absl::StrAppend(&text, "# HELP bakewell_", n, " ", std::string(help), "\n# TYPE bakewell_", n, " ", std::string(type),
                  "\nbakewell_", n, " ", value, "\n");
}

JsonLine JsonOf(const job::JobView& view) {
  const char* const states[] = {"running", "done", "failed", "cancelled"};
  std::vector<JsonLine> phases;
  for (const job::PhaseView& phase : view.phases) {
    phases.push_back(JsonLine().Add("phase", phase.phase).Add("done", phase.done).Add("total", phase.total));
  }
  std::vector<JsonLine> pictures;
  for (const TaskOutput& artifact : view.artifacts) {
    if (artifact.name.ends_with(".png"))
      pictures.push_back(JsonLine().Add("name", artifact.name).Add("parts", int64_t{-1}));
  }
  for (const job::PreviewView& preview : view.previews) {
    // The finished page's picture takes its place.
    const std::string page = absl::StrCat("lightmap-", absl::StripPrefix(preview.name, level_task::kPreviewPrefix));
    const auto finished = [&](const TaskOutput& artifact) { return artifact.name == page; };
    if (std::any_of(view.artifacts.begin(), view.artifacts.end(), finished)) continue;
    pictures.push_back(JsonLine().Add("name", preview.name).Add("parts", preview.parts));
  }
  const bool running = view.row.state == store::JobState::kRunning;
  return JsonLine()
      .Add("id", view.row.id)
      .Add("user", view.row.user)
      .Add("name", view.row.name)
      .Add("state", states[static_cast<int>(view.row.state)])
      .Add("reason", running ? "" : view.row.reason)
      .Add("priority", int64_t{view.row.priority})
      .Add("submitted_us", view.row.submitted_us)
      .Add("finished_us", view.row.finished_us)
      .Add("tasks", view.row.tasks)
      .Add("done", view.tasks_done)
      .Add("known", view.row.known_tasks)
      .Add("run_us", view.row.run_us)
      .Add("left_low_us", int64_t{view.left_low.count()})
      .Add("left_high_us", int64_t{view.left_high.count()})
      .Add("phases", phases)
      .Add("pictures", pictures);
}

JsonLine JsonOf(const job::WorkerView& view) {
  return JsonLine()
      .Add("name", view.about.name)
      .Add("cores", int64_t{view.about.cores})
      .Add("draining", int64_t{view.draining})
      .Add("leases", static_cast<int64_t>(view.leases))
      .Add("done", view.tasks_done)
      .Add("failed", view.tasks_failed)
      .Add("isa", view.about.isa)
      .Add("seen_us_ago", int64_t{view.seen_ago.count()});
}

JsonLine JsonOf(const store::FailureRow& failure) {
  return JsonLine()
      .Add("at_us", failure.at_us)
      .Add("job", failure.job)
      .Add("kind", failure.kind)
      .Add("worker", failure.worker)
      .Add("reason", failure.reason);
}

}  // namespace

std::string MetricsText(const job::Stats& stats, const std::vector<job::WorkerView>& workers, uint64_t refused_calls) {
  std::string text;
  const auto gauge = [&](std::string_view name, std::string_view help, auto value) {
    Metric(text, name, "gauge", help, static_cast<double>(value));
  };
  const auto counter = [&](std::string_view name, std::string_view help, auto value) {
    Metric(text, name, "counter", help, static_cast<double>(value));
  };
  int64_t cores = 0;
  for (const job::WorkerView& worker : workers) cores += worker.about.cores;
  gauge("tasks_ready", "Tasks that wait for a worker; scale workers on it.", stats.ready);
  gauge("tasks_running", "Leases that workers hold.", stats.leases);
  gauge("tasks_in_memory", "Tasks of running jobs.", stats.tasks);
  gauge("jobs_running", "Jobs that have not ended.", stats.running_jobs);
  gauge("workers", "Workers that are connected.", stats.workers);
  gauge("worker_cores", "Cores of all workers.", cores);
  gauge("store_bytes", "Bytes of all blobs.", stats.store_bytes);
  gauge("store_quota_bytes", "Bytes that the store may hold, 0 without a limit.", stats.store_quota_bytes);
  gauge("store_blobs", "Blobs in the store.", stats.blobs);
  gauge("write_backlog", "Changes that wait for a commit.", stats.write_backlog);
  gauge("writable", "1 while the database takes changes.", stats.trouble.empty() ? 1 : 0);
  counter("tasks_completed_total", "Tasks that workers completed.", stats.completed);
  counter("tasks_known_total", "Tasks whose result was known.", stats.known);
  counter("tasks_failed_total", "Runs of tasks that failed.", stats.failed);
  counter("tasks_conflicting_total", "Results with other bytes than the first.", stats.conflicts);
  counter("leases_lost_total", "Leases of workers that fell silent.", stats.lost_leases);
  counter("stragglers_total", "Tasks given to a second worker.", stats.stragglers);
  counter("run_seconds_total", "Run time of completed tasks.", static_cast<double>(stats.run_us) * 1e-6);
  counter("blobs_corrupt_total", "Blobs found corrupt on disk.", stats.corrupt_blobs);
  counter("commits_total", "Commits of the database.", stats.commits);
  counter("writes_total", "Changes written, many to a commit.", stats.writes);
  counter("calls_refused_total", "Calls without a token or scope.", refused_calls);
  return text;
}

absl::StatusOr<std::string> StatusJson(job::Coordinator& coordinator) {
  constexpr int kShown = 50;
  const job::Stats stats = coordinator.GetStats();
  BAKEWELL_ASSIGN_OR_RETURN(const std::vector<job::JobView> views, coordinator.List({"", {}, INT64_MAX, kShown}));
  BAKEWELL_ASSIGN_OR_RETURN(const std::vector<store::FailureRow> rows, coordinator.Failures(0, kShown));
  std::vector<JsonLine> jobs, workers, failures;
  for (const job::JobView& job : views) {
    // A running job in full, with its partial pictures.
    const auto full = coordinator.Get(job.row.id);
    jobs.push_back(JsonOf(full.ok() ? *full : job));
  }
  for (const job::WorkerView& worker : coordinator.Workers()) workers.push_back(JsonOf(worker));
  for (const store::FailureRow& failure : rows) failures.push_back(JsonOf(failure));
  return JsonLine()
      .Add("ready", static_cast<int64_t>(stats.ready))
      .Add("leases", static_cast<int64_t>(stats.leases))
      .Add("completed", stats.completed)
      .Add("known", stats.known)
      .Add("failed", stats.failed)
      .Add("store_bytes", stats.store_bytes)
      .Add("trouble", stats.trouble)
      .Add("now_us", coordinator.WallNowUs())
      .Add("jobs", jobs)
      .Add("workers", workers)
      .Add("failures", failures)
      .Text();
}

}  // namespace bakewell::http
