#pragma once

#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "server/job/coordinator.h"
#include "server/preview/pictures.h"

namespace httplib {
class Server;
}

namespace bakewell::http {

// GET /metrics (Prometheus text), /healthz (200 "ok", 503 and why not), / (the dashboard: one page without outside
// assets), /status.json (what it shows) and /preview/JOB/NAME (a picture of a job, also one that still fills in). Read
// only, and without tokens: listens on loopback unless the address says otherwise; put a proxy in front of it for more.
class Dashboard {
 public:
  // kUnavailable: the port cannot be had. kInvalidArgument: not HOST:PORT. Port 0: any.
  static absl::StatusOr<std::unique_ptr<Dashboard>> Start(job::Coordinator& coordinator, const std::string& listen,
                                                          std::function<uint64_t()> refused_calls);
  ~Dashboard();
  int port() const { return port_; }

 private:
  Dashboard(std::unique_ptr<httplib::Server> server, job::Coordinator& coordinator);
  preview::Pictures pictures_;
  std::unique_ptr<httplib::Server> server_;
  std::thread thread_;
  int port_ = 0;
};

// The texts, apart from HTTP.
std::string MetricsText(const job::Stats& stats, const std::vector<job::WorkerView>& workers, uint64_t refused_calls);
absl::StatusOr<std::string> StatusJson(job::Coordinator& coordinator);

}  // namespace bakewell::http
