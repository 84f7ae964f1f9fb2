#include "tests/support/level_farm.h"

#include <absl/strings/str_cat.h>

#include "core/base/check.h"
#include "server/level/chart_task.h"

namespace bakewell::test {

LevelFarm::LevelFarm(int workers) {
  job::Options options;
  options.folder = dir_.path();
  coordinator_ = job::Coordinator::Open(options, planner_).value();
  charts_ = std::make_unique<job::LocalRunner>(*coordinator_, ChartTasks(), 1);
  rpc::ServerOptions server;
  server.listen = "127.0.0.1:0";
  server_ = rpc::FarmServer::Start(*coordinator_, server).value();
  for (int i = 0; i < workers; ++i) {
    WorkerOptions worker;
    worker.identity = {absl::StrCat("w", i), "", 1, int64_t{4} << 30, {}};
    executors_.push_back(std::make_unique<LevelExecutor>());
    workers_.push_back(std::make_unique<Worker>(Connect(), *executors_.back(), worker));
    threads_.emplace_back([raw = workers_.back().get()] { BAKEWELL_CHECK(raw->Run().ok()); });
  }
}

LevelFarm::~LevelFarm() {
  for (const auto& worker : workers_) worker->Drain();
  for (std::thread& thread : threads_) thread.join();
  workers_.clear();
  server_.reset();
  charts_.reset();
}

std::string LevelFarm::address() const { return absl::StrCat("localhost:", server_->port()); }

std::shared_ptr<Connection> LevelFarm::Connect() const {
  ConnectOptions options;
  options.address = address();
  return Connection::Open(options).value();
}

}  // namespace bakewell::test
