#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <thread>

#include "client/rpc/farm_client.h"
#include "server/job/coordinator.h"
#include "server/job/local_runner.h"
#include "server/plan/level_planner.h"
#include "server/rpc/farm_server.h"
#include "worker/level/executor.h"
#include "worker/rpc/worker.h"

namespace bakewell {

// A whole farm in this process for one job: a coordinator with a store in a folder that is thrown away, a worker with
// all threads, and a client, joined by gRPC's in-process channel. No port is opened.
class EmbeddedFarm {
 public:
  // `folder` is made; the caller removes it. `layout`: SerializeLayout bytes of charts that are there already, or
  // empty. `progress` hears of phases from any thread, and outlives the farm.
  static absl::StatusOr<std::unique_ptr<EmbeddedFarm>> Start(const std::filesystem::path& folder, int threads,
                                                             const std::string& layout, Progress& progress);
  // Stops what runs.
  ~EmbeddedFarm();

  FarmClient& client() { return *client_; }
  // Puts what the job made into the folder, where FarmClient::FetchAll finds it and need not move the bytes; what
  // cannot be linked there it fetches.
  void HandOver(const v1::Job& job, const std::filesystem::path& folder) const;
  // Why nothing goes on (the disk is full), although a farm would wait for it to pass.
  absl::Status Trouble();

 private:
  EmbeddedFarm(int threads, Progress& progress);
  absl::Status Open(const std::filesystem::path& folder, int threads, const std::string& layout, Progress& progress);

  plan::LevelPlanner planner_;
  LevelExecutor executor_;
  std::mutex mutex_;
  absl::Status undelivered_;  // guarded by mutex_
  std::unique_ptr<job::Coordinator> coordinator_;
  std::unique_ptr<job::LocalRunner> charts_;
  std::unique_ptr<rpc::FarmServer> server_;
  std::unique_ptr<FarmClient> client_;
  std::unique_ptr<Worker> worker_;
  std::thread working_;
};

}  // namespace bakewell
