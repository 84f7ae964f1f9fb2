#include "client/cli/admin_command.h"

#include <absl/strings/str_format.h>

#include <memory>

#include "client/cli/commands.h"
#include "client/cli/farm_flags.h"
#include "core/artifact/json_line.h"

namespace bakewell {

namespace {

struct AdminFlags {
  ConnectFlags connect;
  bool json = false;
  uint64_t worker = 0;
  bool resume = false;
  int64_t job = 0;
  int priority = 0;
  std::string user;
  int64_t weight = 1, max_jobs = 0, max_scene_bytes = 0, max_tasks = 0;
  int64_t target_bytes = 0;
  double grace_s = 3600;
};

double Seconds(int64_t microseconds) { return static_cast<double>(microseconds) * 1e-6; }

absl::Status ShowStatus(const AdminFlags& flags, FarmClient& client, const Console& console) {
  BAKEWELL_ASSIGN_OR_RETURN(const v1::StatusResponse status, client.Status());
  if (flags.json) {
    std::vector<JsonLine> failures;
    for (const v1::Failure& failure : status.failures()) {
      failures.push_back(JsonLine()
                             .Add("at_seconds", Seconds(failure.at_us()))
                             .Add("job", failure.job_id())
                             .Add("kind", failure.kind())
                             .Add("worker", failure.worker())
                             .Add("reason", failure.reason()));
    }
    JsonLine line;
    line.Add("event", "status").Add("ready", status.ready()).Add("leases", status.leases());
    line.Add("workers", status.workers()).Add("running_jobs", status.running_jobs());
    line.Add("store_bytes", status.store_bytes()).Add("store_quota_bytes", status.store_quota_bytes());
    line.Add("tasks_completed", status.tasks_completed()).Add("tasks_known", status.tasks_known());
    line.Add("tasks_failed", status.tasks_failed()).Add("conflicts", status.conflicts());
    line.Add("corrupt_blobs", status.corrupt_blobs()).Add("trouble", status.trouble()).Add("failures", failures);
    console.out << line.Text() << std::endl;
    return absl::OkStatus();
  }
  console.out << absl::StrFormat(
      "%d jobs running, %d tasks ready, %d leased, %d workers\n"
      "%d tasks done since the start, %d known, %d failed, %d with other bytes, %d corrupt blobs\n"
      "%.1f MiB stored%s\n",
      status.running_jobs(), status.ready(), status.leases(), status.workers(), status.tasks_completed(),
      status.tasks_known(), status.tasks_failed(), status.conflicts(), status.corrupt_blobs(),
      static_cast<double>(status.store_bytes()) / 1048576, status.trouble().empty() ? "" : ", " + status.trouble());
  for (const v1::Failure& failure : status.failures()) {
    console.out << absl::StrFormat("job %d: %s on %s: %s\n", failure.job_id(), failure.kind(), failure.worker(),
                                   failure.reason());
  }
  console.out << std::flush;
  return absl::OkStatus();
}

absl::Status Drain(const AdminFlags& flags, FarmClient& client, const Console&) {
  return client.DrainWorker(flags.worker, !flags.resume);
}

absl::Status SetPriority(const AdminFlags& flags, FarmClient& client, const Console&) {
  return client.SetPriority(flags.job, flags.priority);
}

absl::Status SetQuota(const AdminFlags& flags, FarmClient& client, const Console&) {
  v1::SetQuotaRequest quota;
  quota.set_user(flags.user);
  quota.set_weight(flags.weight);
  quota.set_max_jobs(flags.max_jobs);
  quota.set_max_scene_bytes(flags.max_scene_bytes);
  quota.set_max_tasks(flags.max_tasks);
  return client.SetQuota(quota);
}

absl::Status CollectGarbage(const AdminFlags& flags, FarmClient& client, const Console& console) {
  const std::chrono::microseconds grace(static_cast<int64_t>(flags.grace_s * 1e6));
  BAKEWELL_ASSIGN_OR_RETURN(const v1::CollectGarbageResponse report, client.CollectGarbage(flags.target_bytes, grace));
  if (flags.json) {
    console.out << JsonLine()
                       .Add("event", "collected")
                       .Add("results", report.results())
                       .Add("blobs", report.blobs())
                       .Add("bytes", report.bytes())
                       .Text()
                << std::endl;
  } else {
    console.out << absl::StrFormat("%d results forgotten, %d blobs removed, %.1f MiB\n", report.results(),
                                   report.blobs(), static_cast<double>(report.bytes()) / 1048576)
                << std::flush;
  }
  return absl::OkStatus();
}

using Command = absl::Status (*)(const AdminFlags&, FarmClient&, const Console&);

}  // namespace

void AddAdminCommand(CLI::App& app, const Console& console, int* exit_code) {
  const auto flags = std::make_shared<AdminFlags>();
  CLI::App* const admin = app.add_subcommand("admin", "What an operator does to a farm");
  admin->require_subcommand(1);
  const auto add = [&](const char* name, const char* about, Command run) {
    CLI::App* const command = admin->add_subcommand(name, about);
    AddConnectFlags(*command, flags->connect);
    command->add_flag("--json", flags->json, "one JSON object a line");
    command->callback([flags, run, &console, exit_code] {
      const auto act = [&]() -> absl::Status {
        BAKEWELL_ASSIGN_OR_RETURN(const auto client, OpenClient(flags->connect));
        return run(*flags, *client, console);
      };
      const absl::Status status = act();
      if (!status.ok()) *exit_code = ReportError(status, flags->json ? OutputForm::kJson : OutputForm::kText, console);
    });
    return command;
  };
  add("status", "Queue, store and recent failures", ShowStatus);
  CLI::App* drain = add("drain", "Give a worker no more tasks: it finishes what it has and leaves", Drain);
  drain->add_option("worker", flags->worker, "its number (bakewell workers --json)")->required();
  drain->add_flag("--resume", flags->resume, "give it tasks again, if it has not left");
  CLI::App* priority = add("priority", "Put a job before or behind others", SetPriority);
  priority->add_option("job", flags->job, "its number")->required();
  priority->add_option("priority", flags->priority, "0 batch, 100 interactive, higher goes first")
      ->required()
      ->check(CLI::Range(0, 1000));
  CLI::App* quota = add("quota", "A user's share and limits, 0 meaning none", SetQuota);
  quota->add_option("user", flags->user)->required();
  quota->add_option("--weight", flags->weight, "share beside other users'")->capture_default_str();
  quota->add_option("--max-jobs", flags->max_jobs, "running at a time")->capture_default_str();
  quota->add_option("--max-scene", flags->max_scene_bytes, "bytes of a scene, as 512MB")
      ->transform(CLI::AsSizeValue(false));
  quota->add_option("--max-tasks", flags->max_tasks, "of a job")->capture_default_str();
  CLI::App* collect = add("gc", "Remove what nobody needs, and known results used longest ago", CollectGarbage);
  collect->add_option("--target", flags->target_bytes, "bytes that may stay, as 10GB")
      ->required()
      ->transform(CLI::AsSizeValue(false));
  collect->add_option("--grace", flags->grace_s, "seconds for which what was touched stays")->capture_default_str();
}

}  // namespace bakewell
