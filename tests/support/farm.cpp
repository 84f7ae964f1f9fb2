#include "tests/support/farm.h"

#include <absl/strings/str_cat.h>

#include "core/base/check.h"
#include "tests/support/slowness.h"

namespace bakewell::test {

Farm::Farm(Options options) : options_(std::move(options)) {
  options_.job.folder = options_.folder;
  if (!options_.in_process && options_.server.listen.empty()) options_.server.listen = "127.0.0.1:0";
  StartCoordinator();
}

Farm::~Farm() {
  StopWorkers();
  StopCoordinator();
}

void Farm::StartCoordinator() {
  auto coordinator = job::Coordinator::Open(options_.job, planner_);
  if (!coordinator.ok()) std::fprintf(stderr, "%s\n", coordinator.status().ToString().c_str());
  BAKEWELL_CHECK(coordinator.ok());
  coordinator_ = *std::move(coordinator);
  auto server = rpc::FarmServer::Start(*coordinator_, options_.server);
  if (!server.ok()) std::fprintf(stderr, "%s\n", server.status().ToString().c_str());
  BAKEWELL_CHECK(server.ok());
  server_ = *std::move(server);
  port_ = server_->port();
  if (!options_.in_process) options_.server.listen = absl::StrCat("127.0.0.1:", port_);
}

void Farm::StopCoordinator() {
  server_.reset();
  coordinator_.reset();
}

std::string Farm::address() const { return absl::StrCat("localhost:", port_); }

std::shared_ptr<Connection> Farm::Connect(const std::string& token) {
  if (options_.in_process) return std::make_shared<Connection>(server_->InProcessChannel(), token);
  ConnectOptions options;
  options.address = address();
  options.token = token;
  auto connection = Connection::Open(options);
  BAKEWELL_CHECK(connection.ok());
  return *connection;
}

std::unique_ptr<FarmClient> Farm::Client(const std::string& token) {
  return std::make_unique<FarmClient>(Connect(token), std::chrono::seconds(30));
}

Farm::RunningWorker& Farm::AddWorker(const std::string& name, WorkerOptions options) {
  options.identity.name = name;
  options.identity.isa = "test";
  options.identity.cores = 1;
  if (options.identity.memory_bytes == 0) options.identity.memory_bytes = int64_t{1} << 30;
  auto running = std::make_unique<RunningWorker>();
  running->worker = std::make_unique<Worker>(Connect(), running->executor, std::move(options));
  running->thread = std::thread([raw = running.get()] { raw->result = raw->worker->Run(); });
  workers_.push_back(std::move(running));
  return *workers_.back();
}

void Farm::StopWorkers() {
  for (const auto& running : workers_) running->worker->Drain();
  for (const auto& running : workers_) {
    if (running->thread.joinable()) running->thread.join();
  }
  workers_.clear();
}

v1::Job Farm::Bake(const SyntheticScene& scene, const std::string& client_key) {
  const auto client = Client();
  const auto submitted = client->Submit(scene.Text(), {client_key, "test", "", false});
  if (!submitted.ok()) std::fprintf(stderr, "%s\n", submitted.status().ToString().c_str());
  BAKEWELL_CHECK(submitted.ok());
  const auto until = std::chrono::steady_clock::now() + kSlowness * std::chrono::seconds(60);
  const auto job =
      client->Watch(submitted->job_id(), [&](const v1::Job&) { return std::chrono::steady_clock::now() < until; });
  if (!job.ok()) std::fprintf(stderr, "%s\n", job.status().ToString().c_str());
  BAKEWELL_CHECK(job.ok());
  return *job;
}

std::string DigestsOf(const v1::Job& job) {
  std::string text;
  for (const v1::Artifact& artifact : job.artifacts()) {
    absl::StrAppend(&text, artifact.name(), " ", DigestFromBytes(artifact.digest()).value_or(Digest{}).Hex(), "\n");
  }
  return text;
}

bool WaitFor(const std::function<bool()>& condition, std::chrono::milliseconds limit) {
  const auto until = std::chrono::steady_clock::now() + kSlowness * limit;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > until) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

}  // namespace bakewell::test
