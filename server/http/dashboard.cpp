#include "server/http/dashboard.h"

#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <httplib.h>

#include "server/http/page.h"

namespace bakewell::http {

namespace {

constexpr int64_t kMaxPreviewBytes = 32 << 20;

// A picture of a job. Names come from the wire and are looked up in the job's artifacts and previews, never in the file
// system.
absl::StatusOr<std::string> Picture(job::Coordinator& coordinator, preview::Pictures& pictures, const std::string& job,
                                    const std::string& name) {
  int64_t id = 0;
  if (!absl::SimpleAtoi(job, &id) || !absl::EndsWith(name, ".png")) return absl::NotFoundError("no such picture");
  if (auto growing = pictures.Png(id, name); growing.ok()) return growing;
  BAKEWELL_ASSIGN_OR_RETURN(const TaskOutput artifact, coordinator.FindArtifact(id, name));
  if (artifact.size_bytes > kMaxPreviewBytes) return absl::ResourceExhaustedError("the picture is too large");
  return coordinator.blobs().Get(artifact.digest);
}

void AddRoutes(httplib::Server& server, job::Coordinator& coordinator, preview::Pictures& pictures,
               std::function<uint64_t()> refused_calls) {
  server.Get("/metrics", [&coordinator, refused_calls](const httplib::Request&, httplib::Response& response) {
    response.set_content(MetricsText(coordinator.GetStats(), coordinator.Workers(), refused_calls()),
                         "text/plain; version=0.0.4");
  });
  server.Get("/healthz", [&coordinator](const httplib::Request&, httplib::Response& response) {
    const job::Stats stats = coordinator.GetStats();
    response.status = stats.trouble.empty() ? 200 : 503;
    response.set_content(stats.trouble.empty() ? "ok\n" : stats.trouble + "\n", "text/plain");
  });
  server.Get("/", [](const httplib::Request&, httplib::Response& response) {
    response.set_header("Content-Security-Policy",
                        "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src 'self'; "
                        "connect-src 'self'");
    response.set_content(kDashboardPage, "text/html; charset=utf-8");
  });
  server.Get("/favicon.ico", [](const httplib::Request&, httplib::Response& response) { response.status = 204; });
  server.Get("/status.json", [&coordinator](const httplib::Request&, httplib::Response& response) {
    const auto json = StatusJson(coordinator);
    response.status = json.ok() ? 200 : 500;
    response.set_content(json.ok() ? *json : "{}", "application/json");
  });
  const auto picture_of = [&coordinator, &pictures](const httplib::Request& request, httplib::Response& response) {
    const auto picture = Picture(coordinator, pictures, request.matches[1], request.matches[2]);
    response.status = picture.ok() ? 200 : 404;
    if (picture.ok())
      response.set_content(*picture, "image/png");
    else
      response.set_content("not found\n", "text/plain");
  };
  server.Get(R"(/preview/(\d+)/(.+))", picture_of);
}

}  // namespace

Dashboard::Dashboard(std::unique_ptr<httplib::Server> server, job::Coordinator& coordinator)
    : pictures_(coordinator), server_(std::move(server)) {}

absl::StatusOr<std::unique_ptr<Dashboard>> Dashboard::Start(job::Coordinator& coordinator, const std::string& listen,
                                                            std::function<uint64_t()> refused_calls) {
  const size_t colon = listen.rfind(':');
  int port = 0;
  if (colon == std::string::npos || !absl::SimpleAtoi(listen.substr(colon + 1), &port)) {
    return absl::InvalidArgumentError(absl::StrCat("--http must be HOST:PORT, not ", listen));
  }
  auto server = std::make_unique<httplib::Server>();
  server->new_task_queue = [] { return new httplib::ThreadPool(4); };
  server->set_payload_max_length(1024);
  server->set_read_timeout(5);
  server->set_write_timeout(10);
  server->set_keep_alive_max_count(100);
  const std::string host = listen.substr(0, colon);
  const bool bound =
      port == 0 ? (port = server->bind_to_any_port(host.c_str())) > 0 : server->bind_to_port(host.c_str(), port);
  if (!bound) return absl::UnavailableError(absl::StrCat("cannot listen on ", listen, " for HTTP"));
  std::unique_ptr<Dashboard> dashboard(new Dashboard(std::move(server), coordinator));
  AddRoutes(*dashboard->server_, coordinator, dashboard->pictures_, std::move(refused_calls));
  dashboard->port_ = port;
  dashboard->thread_ = std::thread([raw = dashboard->server_.get()] { raw->listen_after_bind(); });
  return dashboard;
}

Dashboard::~Dashboard() {
  while (!server_->is_running()) std::this_thread::yield();  // stop() before listen_after_bind() would be lost
  server_->stop();
  thread_.join();
}

}  // namespace bakewell::http
