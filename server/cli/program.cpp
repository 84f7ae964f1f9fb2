#include "server/cli/program.h"

#include <absl/strings/str_cat.h>
#include <signal.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <fstream>
#include <iostream>
#include <map>
#include <random>

#include "server/http/dashboard.h"
#include "server/rpc/auth.h"
#include "server/rpc/farm_server.h"
#include "server/store/database.h"

namespace bakewell {

namespace {

struct ServeFlags {
  std::string data = "bakewell-data";
  std::string http = "127.0.0.1:7718";
  rpc::ServerOptions server{"127.0.0.1:7717", {}, {}, {}, false};
  int64_t quota_bytes = 0;
  store::AccountRow defaults;
  int heartbeat_timeout_s = 15;
  int collect_every_s = 3600;
  int64_t keep_bytes = 0;
};

struct TokenFlags {
  std::string user;
  std::vector<std::string> scopes;
  int days = 0;
  std::string file;  // has the token; empty: one is made and printed
};

int Report(const absl::Status& status) {
  if (status.ok()) return 0;
  std::cerr << "bakewell-server: " << status.message() << "\n";
  return 1;
}

// Waits for SIGINT or SIGTERM, which every thread has blocked.
void WaitForSignal() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  int signal = 0;
  sigwait(&signals, &signal);
}

void BlockSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
}

// As many files as the system lets this process have: every connection is one.
void RaiseFileLimit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

absl::Status Serve(const ServeFlags& flags, const plan::Planner& planner, const job::LocalTasks& local) {
  BlockSignals();
  RaiseFileLimit();
  spdlog::set_default_logger(spdlog::stderr_color_mt("bakewell-server"));
  job::Options options;
  options.folder = flags.data;
  options.quota_bytes = flags.quota_bytes;
  options.defaults = flags.defaults;
  options.sched.heartbeat_timeout = std::chrono::seconds(flags.heartbeat_timeout_s);
  options.collect_every = std::chrono::seconds(flags.collect_every_s);
  options.keep_bytes = flags.keep_bytes;
  options.log = [](std::string_view line) { spdlog::info("{}", line); };
  BAKEWELL_ASSIGN_OR_RETURN(const auto coordinator, job::Coordinator::Open(options, planner));
  const job::LocalRunner runner(*coordinator, local, /*threads=*/2);
  BAKEWELL_ASSIGN_OR_RETURN(const auto server, rpc::FarmServer::Start(*coordinator, flags.server));
  std::unique_ptr<http::Dashboard> dashboard;
  if (!flags.http.empty()) {
    BAKEWELL_ASSIGN_OR_RETURN(dashboard,
                              http::Dashboard::Start(*coordinator, flags.http, [&] { return server->refused(); }));
  }
  spdlog::info("serving {} (port {}), data in {}", flags.server.listen, server->port(), flags.data);
  // Scripts wait for this line.
  std::cout << "ready " << server->port() << " " << (dashboard ? dashboard->port() : 0) << std::endl;
  WaitForSignal();
  spdlog::info("stopping: running tasks go on at their workers and are adopted after the restart");
  return absl::OkStatus();
}

int ScopesFrom(const std::vector<std::string>& names) {
  const std::map<std::string, rpc::Scope> all = {{"submit", rpc::Scope::kSubmit},
                                                 {"work", rpc::Scope::kWork},
                                                 {"read", rpc::Scope::kRead},
                                                 {"admin", rpc::Scope::kAdmin}};
  int scopes = 0;
  for (const std::string& name : names) scopes |= static_cast<int>(all.at(name));
  return scopes;
}

int64_t NowUs() {
  return std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

// 256 bits of the kernel's, in hexadecimal.
std::string RandomToken() {
  Digest secret;
  std::random_device random;
  for (uint8_t& byte : secret.bytes) byte = static_cast<uint8_t>(random());
  return secret.Hex();
}

absl::Status AddToken(const std::string& data, const TokenFlags& flags) {
  if (!IsPlainName(flags.user)) return absl::InvalidArgumentError("--user must be 1 to 64 of [A-Za-z0-9_.-]");
  std::filesystem::create_directories(data);
  BAKEWELL_ASSIGN_OR_RETURN(const auto tables, store::Tables::Open(std::filesystem::path(data) / "farm.db"));
  std::string token = RandomToken();
  if (!flags.file.empty()) {
    constexpr size_t kLeastCharacters = 32;
    std::ifstream file(flags.file);
    if (!(file >> token) || token.size() < kLeastCharacters) {
      return absl::InvalidArgumentError(absl::StrCat("no token of at least ", kLeastCharacters, " characters in ",
                                                     flags.file, "; `openssl rand -hex 32` makes one"));
    }
  }
  const int64_t expires_us = flags.days == 0 ? 0 : NowUs() + int64_t{86'400'000'000} * flags.days;
  BAKEWELL_RETURN_IF_ERROR(
      tables->PutToken({Sha256Of(token), flags.user, ScopesFrom(flags.scopes), NowUs(), expires_us}));
  if (flags.file.empty()) std::cout << token << "\n";
  return absl::OkStatus();
}

absl::Status RevokeTokens(const std::string& data, const std::string& user) {
  BAKEWELL_ASSIGN_OR_RETURN(const auto tables, store::Tables::Open(std::filesystem::path(data) / "farm.db"));
  return tables->DeleteTokensOf(user);
}

void AddServeFlags(CLI::App& serve, ServeFlags& flags) {
  serve.add_option("--listen", flags.server.listen, "address and port of the services")->capture_default_str();
  serve.add_option("--http", flags.http, "address and port of dashboard and metrics; empty: none")
      ->capture_default_str();
  serve.add_option("--cert", flags.server.cert_file, "certificate (PEM): turns TLS on");
  serve.add_option("--key", flags.server.key_file, "its private key (PEM)");
  serve.add_option("--client-ca", flags.server.client_ca_file, "clients must show a certificate signed by this one");
  serve.add_flag("--allow-plain-text", flags.server.allow_plain_text,
                 "serve beyond loopback without TLS, where the network encrypts");
  serve.add_option("--quota", flags.quota_bytes, "bytes that the blob store may hold; 0: no limit")
      ->transform(CLI::AsSizeValue(false));
  serve.add_option("--max-blob", flags.server.max_blob_bytes, "bytes of one blob")->transform(CLI::AsSizeValue(false));
  serve.add_option("--max-scene", flags.defaults.max_scene_bytes, "bytes of a user's scene; 0: no limit")
      ->transform(CLI::AsSizeValue(false));
  serve.add_option("--max-jobs", flags.defaults.max_jobs, "jobs that a user may have running; 0: no limit");
  serve.add_option("--max-tasks", flags.defaults.max_tasks, "tasks of a job; 0: no limit");
  serve.add_option("--heartbeat-timeout", flags.heartbeat_timeout_s, "seconds until a silent worker's tasks go back")
      ->check(CLI::Range(1, 3600));
  serve.add_option("--collect-every", flags.collect_every_s, "seconds between collections of garbage; 0: only by hand")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  serve
      .add_option("--keep", flags.keep_bytes,
                  "bytes above which a collection forgets results, oldest use first; 0: nine tenths of --quota")
      ->transform(CLI::AsSizeValue(false));
}

}  // namespace

int RunServerProgram(int argc, char** argv, const plan::Planner& planner, const job::LocalTasks& local) {
  CLI::App app("The coordinator of a bakewell farm.");
  app.require_subcommand(1);
  ServeFlags flags;
  TokenFlags token_flags;
  std::string backup_to;
  int exit_code = 0;
  app.add_option("--data", flags.data, "folder of database and blobs")->capture_default_str();

  CLI::App* serve = app.add_subcommand("serve", "Serve until SIGTERM");
  AddServeFlags(*serve, flags);
  serve->callback([&] { exit_code = Report(Serve(flags, planner, local)); });

  CLI::App* backup = app.add_subcommand("backup", "Copy the database, also of a running server, to a new file");
  backup->add_option("file", backup_to)->required();
  backup->callback(
      [&] { exit_code = Report(store::BackupDatabase(std::filesystem::path(flags.data) / "farm.db", backup_to)); });

  CLI::App* token = app.add_subcommand("token", "Make or revoke tokens");
  token->require_subcommand(1);
  CLI::App* add = token->add_subcommand("add", "Print a new token; only its hash is kept");
  add->add_option("--user", token_flags.user)->required();
  add->add_option("--scopes", token_flags.scopes, "submit, work, read, admin")
      ->required()
      ->delimiter(',')
      ->check(CLI::IsMember({"submit", "work", "read", "admin"}));
  add->add_option("--days", token_flags.days, "valid for; 0: for ever");
  add->add_option("--file", token_flags.file, "has the token: nothing is made or printed; may be repeated");
  add->callback([&] { exit_code = Report(AddToken(flags.data, token_flags)); });
  CLI::App* revoke = token->add_subcommand("revoke", "Revoke every token of a user");
  revoke->add_option("--user", token_flags.user)->required();
  revoke->callback([&] { exit_code = Report(RevokeTokens(flags.data, token_flags.user)); });

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return exit_code;
}

}  // namespace bakewell
