// Ten thousand connections that say nothing: the server serves the others.
#include <absl/strings/str_cat.h>
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <optional>

#include "tests/support/farm.h"
#include "tests/support/process.h"
#include "tests/support/slowness.h"
#include "tests/support/temp_dir.h"

namespace bakewell::test {
namespace {

// Sockets that connect and then are silent.
class Crowd {
 public:
  explicit Crowd(int port) : port_(port) {}
  ~Crowd() {
    for (const int file : files_) close(file);
  }
  void Join() {
    const int file = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(port_));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (file >= 0 && connect(file, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0) {
      files_.push_back(file);
    } else if (file >= 0) {
      close(file);
    }
  }
  size_t size() const { return files_.size(); }

 private:
  const int port_;
  std::vector<int> files_;
};

TEST(Crowd, TenThousandConnectionsDoNotStopTheService) {
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &limit), 0);
  limit.rlim_cur = limit.rlim_max;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &limit), 0);
  ASSERT_GE(limit.rlim_max, 10'500u) << "raise the hard limit of open files: ulimit -Hn";
  const TempDir dir("/dev/shm");
  const int port = FreePort();
  Process server({SYNTHETIC_SERVER, "--data", (dir.path() / "data").string(), "serve", "--listen",
                  absl::StrCat("127.0.0.1:", port), "--http", ""},
                 (dir.path() / "server.log").string());
  ASSERT_EQ(server.ReadLine().rfind("ready", 0), 0u);
  Process worker({SYNTHETIC_WORKER, "--server", absl::StrCat("localhost:", port), "--threads", "1", "--name", "w"},
                 (dir.path() / "worker.log").string());
  Crowd crowd(port);
  for (int i = 0; i < 10'000; ++i) crowd.Join();
  EXPECT_GE(crowd.size(), 9'900u);
  ConnectOptions options;
  options.address = absl::StrCat("localhost:", port);
  FarmClient client(Connection::Open(options).value(), std::chrono::seconds(30));
  const auto start = std::chrono::steady_clock::now();
  const auto job = client.Submit(SyntheticScene().Text(), {});
  ASSERT_TRUE(job.ok()) << job.status();
  const auto ended = client.Watch(job->job_id(), [](const v1::Job&) { return true; });
  ASSERT_TRUE(ended.ok()) << ended.status();
  EXPECT_EQ(ended->state(), v1::DONE) << ended->reason();
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(15) * kSlowness);
}

}  // namespace
}  // namespace bakewell::test
