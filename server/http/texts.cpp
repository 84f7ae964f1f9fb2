// What /metrics and /status.json say.
#include <absl/strings/str_cat.h>

#include <nlohmann/json.hpp>

#include "server/http/dashboard.h"

namespace bakewell::http {

namespace {

void Metric(std::string& text, std::string_view name, std::string_view type, std::string_view help, double value) {
  const absl::string_view n(name.data(), name.size());
  absl::StrAppend(&text, "# HELP bakewell_", n, " ", std::string(help), "\n# TYPE bakewell_", n, " ", std::string(type),
                  "\nbakewell_", n, " ", value, "\n");
}

nlohmann::json JsonOf(const job::JobView& view) {
  const char* const states[] = {"running", "done", "failed", "cancelled"};
  nlohmann::json job = {{"id", view.row.id},
                        {"user", view.row.user},
                        {"name", view.row.name},
                        {"state", states[static_cast<int>(view.row.state)]},
                        {"reason", view.row.state == store::JobState::kRunning ? "" : view.row.reason},
                        {"priority", view.row.priority},
                        {"submitted_us", view.row.submitted_us},
                        {"finished_us", view.row.finished_us},
                        {"tasks", view.row.tasks},
                        {"done", view.tasks_done},
                        {"known", view.row.known_tasks},
                        {"run_us", view.row.run_us},
                        {"left_low_us", view.left_low.count()},
                        {"left_high_us", view.left_high.count()},
                        {"phases", nlohmann::json::array()},
                        {"previews", nlohmann::json::array()}};
  for (const job::PhaseView& phase : view.phases) {
    job["phases"].push_back({{"phase", phase.phase}, {"done", phase.done}, {"total", phase.total}});
  }
  for (const TaskOutput& artifact : view.artifacts) {
    if (artifact.name.ends_with(".png")) job["previews"].push_back(artifact.name);
  }
  return job;
}

nlohmann::json JsonOf(const job::WorkerView& view) {
  return {{"name", view.about.name},   {"cores", view.about.cores},
          {"draining", view.draining}, {"leases", view.leases},
          {"done", view.tasks_done},   {"failed", view.tasks_failed},
          {"isa", view.about.isa},     {"seen_us_ago", view.seen_ago.count()}};
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
  nlohmann::json status = {{"ready", stats.ready},
                           {"leases", stats.leases},
                           {"workers_count", stats.workers},
                           {"completed", stats.completed},
                           {"known", stats.known},
                           {"failed", stats.failed},
                           {"store_bytes", stats.store_bytes},
                           {"trouble", stats.trouble},
                           {"now_us", coordinator.WallNowUs()}};
  status["jobs"] = nlohmann::json::array();
  BAKEWELL_ASSIGN_OR_RETURN(const std::vector<job::JobView> jobs, coordinator.List({"", {}, INT64_MAX, kShown}));
  for (const job::JobView& job : jobs) {
    // A running job in full, with its partial pictures.
    const auto full = coordinator.Get(job.row.id);
    status["jobs"].push_back(JsonOf(full.ok() ? *full : job));
  }
  status["workers"] = nlohmann::json::array();
  for (const job::WorkerView& worker : coordinator.Workers()) status["workers"].push_back(JsonOf(worker));
  status["failures"] = nlohmann::json::array();
  BAKEWELL_ASSIGN_OR_RETURN(const std::vector<store::FailureRow> failures, coordinator.Failures(0, kShown));
  for (const store::FailureRow& failure : failures) {
    status["failures"].push_back({{"at_us", failure.at_us},
                                  {"job", failure.job},
                                  {"kind", failure.kind},
                                  {"worker", failure.worker},
                                  {"reason", failure.reason}});
  }
  return status.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace bakewell::http
