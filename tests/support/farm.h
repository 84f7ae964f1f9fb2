#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "client/rpc/farm_client.h"
#include "server/job/coordinator.h"
#include "server/rpc/farm_server.h"
#include "tests/support/synthetic.h"
#include "worker/rpc/worker.h"

namespace bakewell::test {

// A farm in this process: a coordinator that can be stopped and started on the same folder and port, workers on
// threads, and clients, all over real sockets unless `in_process`.
class Farm {
 public:
  struct Options {
    std::filesystem::path folder;
    bool in_process = false;
    job::Options job;  // its folder is set
    rpc::ServerOptions server;
  };
  explicit Farm(Options options);
  ~Farm();

  void StartCoordinator();
  void StopCoordinator();
  job::Coordinator& coordinator() { return *coordinator_; }
  rpc::FarmServer& server() { return *server_; }
  int port() const { return port_; }
  std::string address() const;

  std::shared_ptr<Connection> Connect(const std::string& token = "");
  std::unique_ptr<FarmClient> Client(const std::string& token = "");

  struct RunningWorker {
    SyntheticExecutor executor;
    std::unique_ptr<Worker> worker;
    absl::Status result;
    std::thread thread;
  };
  RunningWorker& AddWorker(const std::string& name, WorkerOptions options = {});
  void StopWorkers();

  // Submits, waits and returns the ended job; aborts the test if it takes longer than a minute (slowness.h).
  v1::Job Bake(const SyntheticScene& scene, const std::string& client_key = "");

 private:
  Options options_;
  SyntheticPlanner planner_;
  std::unique_ptr<job::Coordinator> coordinator_;
  std::unique_ptr<rpc::FarmServer> server_;
  int port_ = 0;
  std::vector<std::unique_ptr<RunningWorker>> workers_;
};

// Name and digest of every artifact, in order: two runs that agree are equal.
std::string DigestsOf(const v1::Job& job);

// Polls until `condition` holds or the time is over (times kSlowness); whether it held.
bool WaitFor(const std::function<bool()>& condition, std::chrono::milliseconds limit = std::chrono::seconds(20));

}  // namespace bakewell::test
