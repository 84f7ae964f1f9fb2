#pragma once

#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "client/rpc/farm_client.h"
#include "server/job/local_runner.h"
#include "server/plan/level_planner.h"
#include "server/rpc/farm_server.h"
#include "tests/support/temp_dir.h"
#include "worker/level/executor.h"
#include "worker/rpc/worker.h"

namespace bakewell::test {

// A farm that bakes levels, in this process, over a real socket: what bakewell-server and bakewell-worker are made of.
class LevelFarm {
 public:
  explicit LevelFarm(int workers);
  ~LevelFarm();

  std::string address() const;
  std::shared_ptr<Connection> Connect() const;
  job::Coordinator& coordinator() { return *coordinator_; }

 private:
  const TempDir dir_{"/dev/shm"};
  const plan::LevelPlanner planner_;
  std::unique_ptr<job::Coordinator> coordinator_;
  std::unique_ptr<job::LocalRunner> charts_;
  std::unique_ptr<rpc::FarmServer> server_;
  std::vector<std::unique_ptr<LevelExecutor>> executors_;
  std::vector<std::unique_ptr<Worker>> workers_;
  std::vector<std::thread> threads_;
};

}  // namespace bakewell::test
