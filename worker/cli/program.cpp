#include "worker/cli/program.h"

#include <signal.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <fstream>
#include <thread>

#include "worker/rpc/worker.h"

namespace bakewell {

namespace {

struct Flags {
  ConnectOptions connect;
  std::string token_file;
  WorkerOptions worker;
  int threads = 0;
  double idle_exit_s = 0, grace_s = 30;
};

std::string DefaultName() {
  char host[48] = "worker";
  gethostname(host, sizeof(host) - 1);
  return std::string(host) + "-" + std::to_string(getpid());
}

int64_t MemoryOfMachine() { return int64_t{sysconf(_SC_PHYS_PAGES)} * sysconf(_SC_PAGE_SIZE); }

void AddFlags(CLI::App& app, Flags& flags) {
  app.add_option("--server", flags.connect.address, "the coordinator's HOST:PORT")->capture_default_str();
  app.add_option("--ca", flags.connect.ca_file, "certificate authority (PEM): turns TLS on");
  app.add_option("--cert", flags.connect.cert_file, "own certificate, for mutual TLS");
  app.add_option("--key", flags.connect.key_file, "its private key");
  app.add_option("--token-file", flags.token_file, "file with the token; else the environment's BAKEWELL_TOKEN");
  app.add_option("--name", flags.worker.identity.name, "for people; default: host and process");
  app.add_option("--threads", flags.threads, "tasks at a time, one thread each; 0: the machine's cores")
      ->check(CLI::Range(0, 1024));
  app.add_option("--cache-size", flags.worker.cache_bytes, "bytes of inputs kept, as 512MB or 2GB")
      ->transform(CLI::AsSizeValue(false));
  app.add_option("--memory", flags.worker.identity.memory_bytes,
                 "bytes that tasks may use; default: 3/4 of the machine")
      ->transform(CLI::AsSizeValue(false));
  app.add_flag("--once", flags.worker.once, "leave after one task");
  app.add_option("--idle-exit", flags.idle_exit_s, "leave after so many seconds without a task; 0: never");
  app.add_option("--grace", flags.grace_s, "seconds that running tasks get after SIGTERM")->capture_default_str();
}

absl::Status Complete(Flags& flags) {
  if (!flags.token_file.empty()) {
    std::ifstream file(flags.token_file);
    if (!(file >> flags.connect.token)) return absl::InvalidArgumentError("cannot read a token in " + flags.token_file);
  } else if (const char* token = std::getenv("BAKEWELL_TOKEN")) {
    flags.connect.token = token;
  }
  WorkerIdentity& identity = flags.worker.identity;
  if (flags.threads == 0) flags.threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  if (identity.name.empty()) identity.name = DefaultName();
  if (identity.memory_bytes == 0) identity.memory_bytes = MemoryOfMachine() / 4 * 3;
  identity.cores = flags.threads;
  identity.isa = "x86-64-v3";
  flags.worker.slots = flags.threads;
  flags.worker.prefetch = flags.threads + 1;
  flags.worker.idle_exit = std::chrono::milliseconds(static_cast<int64_t>(1000 * flags.idle_exit_s));
  flags.worker.grace = std::chrono::milliseconds(static_cast<int64_t>(1000 * flags.grace_s));
  flags.worker.log = [](std::string_view line) { spdlog::info("{}", line); };
  return absl::OkStatus();
}

absl::Status Work(Flags flags, const MakeExecutor& make_executor) {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  spdlog::set_default_logger(spdlog::stderr_color_mt("bakewell-worker"));
  BAKEWELL_RETURN_IF_ERROR(Complete(flags));
  BAKEWELL_ASSIGN_OR_RETURN(const auto connection, Connection::Open(flags.connect));
  const std::unique_ptr<TaskExecutor> executor = make_executor(flags.threads);
  Worker worker(connection, *executor, flags.worker);
  std::atomic<bool> left = false;
  std::thread signalled([&] {
    for (int signal = 0; !left;) {
      if (sigwait(&signals, &signal) == 0) worker.Drain();
    }
  });
  const absl::Status status = worker.Run();
  left = true;
  pthread_kill(signalled.native_handle(), SIGTERM);  // nobody else wakes it
  signalled.join();
  const WorkerCounters counters = worker.counters();
  spdlog::info("{} tasks done, {} failed, {} given back", counters.done, counters.failed, counters.given_back);
  if (!worker.WaitForTasks(std::chrono::seconds(2))) {
    spdlog::warn("a task that was told to stop goes on: leaving without it");
    spdlog::shutdown();
    std::_Exit(status.ok() ? 0 : 1);
  }
  return status;
}

}  // namespace

int RunWorkerProgram(int argc, char** argv, const MakeExecutor& make_executor) {
  CLI::App app("A worker of a bakewell farm.");
  Flags flags;
  AddFlags(app, flags);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  const absl::Status status = Work(flags, make_executor);
  if (status.ok()) return 0;
  std::cerr << "bakewell-worker: " << status.message() << "\n";
  return 1;
}

}  // namespace bakewell
