#include "client/cli/farm_commands.h"

#include <absl/strings/str_format.h>

#include <chrono>
#include <map>
#include <memory>

#include "client/cli/bake_flags.h"
#include "client/cli/commands.h"
#include "client/cli/farm_flags.h"
#include "client/job/result.h"
#include "client/job/submission.h"
#include "client/rpc/farm_client.h"
#include "core/artifact/json_line.h"

namespace bakewell {

namespace {

namespace fs = std::filesystem;

// What every one of the commands has.
struct FarmFlags {
  ConnectFlags connect;
  bool json = false;
  BakeFlags bake;
  int64_t job = 0;
  std::string name, client_key, output = "out", user;
  bool wait = false, interactive = false;
  v1::JobState state = v1::JOB_STATE_UNSPECIFIED;
  int limit = 20;
};

absl::StatusOr<Submission> Prepare(const FarmFlags& flags) {
  BAKEWELL_ASSIGN_OR_RETURN(const BakeSettings settings, SettingsFromFlags(flags.bake));
  return MakeSubmission(flags.bake.scene, settings);
}

SubmitOptions OptionsOf(const FarmFlags& flags, const Submission& submission) {
  return {flags.client_key, flags.name, submission.settings_bytes, flags.interactive};
}

std::string StateName(v1::JobState state) {
  std::string name = v1::JobState_Name(state);
  for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return name;
}

void PrintJob(const v1::Job& job, const FarmFlags& flags, const Console& console) {
  if (flags.json) {
    JsonLine line;
    line.Add("event", "job").Add("job", job.id()).Add("state", StateName(job.state())).Add("name", job.name());
    line.Add("user", job.user()).Add("tasks", job.tasks_total()).Add("done", job.tasks_done());
    line.Add("known", job.tasks_known()).Add("run_seconds", static_cast<double>(job.run_us()) * 1e-6);
    if (job.has_left_low_us()) {
      line.Add("left_low_seconds", static_cast<double>(job.left_low_us()) * 1e-6);
      line.Add("left_high_seconds", static_cast<double>(job.left_high_us()) * 1e-6);
    }
    console.out << line.Add("reason", job.reason()).Text() << std::endl;
    return;
  }
  console.out << absl::StrFormat("%6d  %-9s  %5d of %5d tasks (%d known)  %s%s%s\n", job.id(), StateName(job.state()),
                                 job.tasks_done(), job.tasks_total(), job.tasks_known(), job.name(),
                                 job.reason().empty() ? "" : ": ", job.reason())
              << std::flush;
}

// One line that is written again: phases with their counts, and the time left.
void PrintProgress(const v1::Job& job, const Console& console) {
  constexpr int kWidth = 24;
  const double share =
      job.tasks_total() > 0 ? static_cast<double>(job.tasks_done()) / static_cast<double>(job.tasks_total()) : 0;
  const int filled = static_cast<int>(share * kWidth);
  std::string phase;
  for (const v1::PhaseProgress& one : job.phases()) {
    if (one.done() < one.total()) phase = absl::StrFormat("%s %d/%d", one.phase(), one.done(), one.total());
  }
  std::string left;
  if (job.has_left_low_us()) {
    left = absl::StrFormat(", %.0f to %.0f s left", static_cast<double>(job.left_low_us()) * 1e-6,
                           static_cast<double>(job.left_high_us()) * 1e-6);
  }
  console.err << absl::StrFormat("\r\x1b[K[%s%s] %3.0f %%  %s%s", std::string(filled, '='),
                                 std::string(kWidth - filled, ' '), share * 100, phase, left)
              << std::flush;
}

absl::StatusOr<v1::Job> WatchJob(FarmClient& client, int64_t id, const FarmFlags& flags, const Console& console) {
  const auto changed = [&](const v1::Job& job) {
    if (flags.json)
      PrintJob(job, flags, console);
    else if (console.err_is_terminal)
      PrintProgress(job, console);
    return true;
  };
  auto job = client.Watch(id, changed);
  if (!flags.json && console.err_is_terminal) console.err << "\r\x1b[K" << std::flush;
  return job;
}

absl::Status SubmitOnly(const FarmFlags& flags, const Submission& submission, FarmClient& client,
                        const Console& console) {
  BAKEWELL_ASSIGN_OR_RETURN(const v1::SubmitResponse submitted,
                            client.Submit(submission.scene_bytes, OptionsOf(flags, submission)));
  for (const std::string& warning : submission.level.warnings) console.err << "warning: " << warning << "\n";
  BAKEWELL_ASSIGN_OR_RETURN(const v1::Job job, client.Get(submitted.job_id()));
  PrintJob(job, flags, console);
  return absl::OkStatus();
}

absl::Status SubmitAndFetch(const FarmFlags& flags, const Submission& submission, FarmClient& client,
                            const Console& console) {
  const auto start = std::chrono::steady_clock::now();
  // A folder that cannot be written is said now, not after the bake.
  BAKEWELL_ASSIGN_OR_RETURN(OutputDir out, OutputDir::Create(flags.bake.output));
  BAKEWELL_ASSIGN_OR_RETURN(const v1::SubmitResponse submitted,
                            client.Submit(submission.scene_bytes, OptionsOf(flags, submission)));
  BAKEWELL_ASSIGN_OR_RETURN(const v1::Job job, WatchJob(client, submitted.job_id(), flags, console));
  PrintJob(job, flags, console);
  BAKEWELL_RETURN_IF_ERROR(StatusOfEnded(job, flags.bake.scene));
  BAKEWELL_ASSIGN_OR_RETURN(const Manifest manifest, FetchResult(client, job, submission, out));
  BAKEWELL_ASSIGN_OR_RETURN(BakeSummary summary, Conclude(out, flags.bake.output, manifest));
  summary.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  summary.cpu_seconds = static_cast<double>(job.run_us()) * 1e-6;
  summary.phases = PhasesOf(job);
  PrintSummary(summary, flags.json ? OutputForm::kJson : OutputForm::kText, console);
  return absl::OkStatus();
}

absl::Status Submit(FarmFlags& flags, const Console& console) {
  BAKEWELL_ASSIGN_OR_RETURN(const Submission submission, Prepare(flags));
  BAKEWELL_ASSIGN_OR_RETURN(const auto client, OpenClient(flags.connect));
  return (flags.wait ? SubmitAndFetch : SubmitOnly)(flags, submission, *client, console);
}

absl::Status Estimate(FarmFlags& flags, const Console& console) {
  BAKEWELL_ASSIGN_OR_RETURN(const Submission submission, Prepare(flags));
  BAKEWELL_ASSIGN_OR_RETURN(const auto client, OpenClient(flags.connect));
  BAKEWELL_ASSIGN_OR_RETURN(const v1::EstimateResponse cost,
                            client->Estimate(submission.scene_bytes, OptionsOf(flags, submission)));
  const double low = static_cast<double>(cost.run_us_low()) * 1e-6,
               high = static_cast<double>(cost.run_us_high()) * 1e-6;
  if (flags.json) {
    console.out << JsonLine()
                       .Add("event", "estimate")
                       .Add("tasks", cost.tasks())
                       .Add("known", cost.tasks_known())
                       .Add("run_seconds_low", low)
                       .Add("run_seconds_high", high)
                       .Add("complete", int64_t{cost.complete()})
                       .Text()
                << std::endl;
    return absl::OkStatus();
  }
  console.out << absl::StrFormat("%d tasks, %d of them known; %.1f to %.1f s of work%s\n", cost.tasks(),
                                 cost.tasks_known(), low, high,
                                 cost.complete() ? "" : ", and more once the charts are known");
  return absl::OkStatus();
}

absl::Status List(FarmFlags& flags, const Console& console) {
  BAKEWELL_ASSIGN_OR_RETURN(const auto client, OpenClient(flags.connect));
  v1::ListRequest filter;
  filter.set_user(flags.user);
  filter.set_state(flags.state);
  BAKEWELL_ASSIGN_OR_RETURN(const std::vector<v1::Job> jobs, client->List(filter, flags.limit));
  for (const v1::Job& job : jobs) PrintJob(job, flags, console);
  return absl::OkStatus();
}

absl::Status Watch(FarmFlags& flags, const Console& console) {
  BAKEWELL_ASSIGN_OR_RETURN(const auto client, OpenClient(flags.connect));
  BAKEWELL_ASSIGN_OR_RETURN(const v1::Job job, WatchJob(*client, flags.job, flags, console));
  PrintJob(job, flags, console);
  return StatusOfEnded(job, {});
}

absl::Status Cancel(FarmFlags& flags, const Console& console) {
  BAKEWELL_ASSIGN_OR_RETURN(const auto client, OpenClient(flags.connect));
  BAKEWELL_ASSIGN_OR_RETURN(const v1::Job job, client->Cancel(flags.job));
  PrintJob(job, flags, console);
  return absl::OkStatus();
}

absl::Status Fetch(FarmFlags& flags, const Console& console) {
  BAKEWELL_ASSIGN_OR_RETURN(const auto client, OpenClient(flags.connect));
  BAKEWELL_ASSIGN_OR_RETURN(const v1::Job job, client->Get(flags.job));
  BAKEWELL_RETURN_IF_ERROR(client->FetchAll(job, flags.output));
  for (const v1::Artifact& artifact : job.artifacts()) {
    console.out << (fs::path(flags.output) / artifact.name()).string() << "\n";
  }
  for (const v1::Preview& preview : job.previews()) {
    const absl::Status status = client->FetchPreview(job.id(), preview, flags.output);
    if (absl::IsNotFound(status)) continue;  // the job has ended meanwhile
    BAKEWELL_RETURN_IF_ERROR(status);
    console.out << (fs::path(flags.output) / preview.name()).string() << "\n";
  }
  return absl::OkStatus();
}

absl::Status Workers(FarmFlags& flags, const Console& console) {
  BAKEWELL_ASSIGN_OR_RETURN(const auto client, OpenClient(flags.connect));
  BAKEWELL_ASSIGN_OR_RETURN(const v1::ListWorkersResponse response, client->Workers());
  for (const v1::WorkerState& worker : response.workers()) {
    if (flags.json) {
      console.out << JsonLine()
                         .Add("event", "worker")
                         .Add("worker", static_cast<int64_t>(worker.id()))
                         .Add("name", worker.name())
                         .Add("cores", int64_t{worker.cores()})
                         .Add("leases", int64_t{worker.leases()})
                         .Add("done", worker.tasks_done())
                         .Add("failed", worker.tasks_failed())
                         .Text()
                  << "\n";
    } else {
      console.out << absl::StrFormat("%12d  %-24s %3d cores  %3d leases  %6d done  %4d failed%s\n", worker.id(),
                                     worker.name(), worker.cores(), worker.leases(), worker.tasks_done(),
                                     worker.tasks_failed(), worker.draining() ? "  draining" : "");
    }
  }
  console.out << std::flush;
  return absl::OkStatus();
}

using Command = absl::Status (*)(FarmFlags&, const Console&);

// Makes a subcommand that connects and runs `run`.
CLI::App* AddCommand(CLI::App& app, const char* name, const char* about, const std::shared_ptr<FarmFlags>& flags,
                     Command run, const Console& console, int* exit_code) {
  CLI::App* const command = app.add_subcommand(name, about);
  AddConnectFlags(*command, flags->connect);
  command->callback([flags, run, &console, exit_code] {
    const bool json = flags->json || flags->bake.json;
    flags->json = json;
    const absl::Status status = run(*flags, console);
    if (!status.ok()) *exit_code = ReportError(status, json ? OutputForm::kJson : OutputForm::kText, console);
  });
  return command;
}

void AddJson(CLI::App* command, FarmFlags& flags) { command->add_flag("--json", flags.json, "one JSON object a line"); }

}  // namespace

void AddFarmCommands(CLI::App& app, const Console& console, int* exit_code) {
  const auto flags = std::make_shared<FarmFlags>();
  const auto add = [&](const char* name, const char* about, Command run) {
    return AddCommand(app, name, about, flags, run, console, exit_code);
  };
  CLI::App* submit = add("submit", "Bake a level on the farm", Submit);
  AddSharedFlags(*submit, flags->bake);
  AddBakeOnlyFlags(*submit, flags->bake);
  submit->add_flag("--wait", flags->wait, "wait, and fetch the result into the folder of -o");
  submit->add_flag("--interactive", flags->interactive, "before every batch job");
  submit->add_option("--name", flags->name, "for people");
  submit->add_option("--client-key", flags->client_key, "makes a repeated submit the same job");
  CLI::App* estimate = add("estimate", "What a bake on the farm would cost", Estimate);
  AddSharedFlags(*estimate, flags->bake);
  AddBakeOnlyFlags(*estimate, flags->bake);

  for (const auto& [name, about, run] :
       {std::tuple{"watch", "Follow a job until it ends", Command(Watch)},
        std::tuple{"cancel", "End a job; what is done stays known", Command(Cancel)},
        std::tuple{"fetch", "Fetch a job's files, also partial ones", Command(Fetch)}}) {
    CLI::App* command = add(name, about, run);
    command->add_option("job", flags->job, "its number")->required();
    AddJson(command, *flags);
    if (run == Command(Fetch)) command->add_option("-o,--output", flags->output, "folder")->capture_default_str();
  }
  CLI::App* list = add("list", "Jobs, newest first", List);
  list->add_option("--user", flags->user, "of this user only");
  const std::map<std::string, v1::JobState> states = {
      {"running", v1::RUNNING}, {"done", v1::DONE}, {"failed", v1::FAILED}, {"cancelled", v1::CANCELLED}};
  list->add_option("--state", flags->state, "in this state only: running, done, failed or cancelled")
      ->transform(CLI::Transformer(states));
  list->add_option("--limit", flags->limit, "how many")->capture_default_str();
  AddJson(list, *flags);
  AddJson(add("workers", "Workers that are connected", Workers), *flags);
}

}  // namespace bakewell
