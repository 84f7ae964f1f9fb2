// Who may do what, and what a hostile client can do: nothing, and the service goes on.
#include <absl/strings/str_cat.h>
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <random>

#include "proto/bakewell/v1/bake.grpc.pb.h"
#include "proto/bakewell/v1/blob.grpc.pb.h"
#include "proto/rpc/transfer.h"
#include "server/rpc/auth.h"
#include "tests/integration/logged_farm.h"

namespace bakewell::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

class SecurityTest : public LoggedFarm {
 protected:
  static void AddToken(Farm& farm, const std::string& token, const std::string& user, int scopes, int64_t expires_us) {
    ASSERT_TRUE(farm.coordinator()
                    .writer()
                    .Run([&](store::Tables& tables) {
                      return tables.PutToken({Sha256Of(token), user, scopes, 1, expires_us});
                    })
                    .ok());
  }
  static int Socket(int port) {
    const int file = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (connect(file, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0) return file;
    close(file);
    return -1;
  }
  // openssl makes a key and a certificate of its own authority, for localhost.
  void MakeCertificates() {
    const std::string in = absl::StrCat("cd ", dir.path().string(), " && ");
    const char* const commands[] = {
        "openssl req -x509 -newkey rsa:2048 -nodes -keyout ca.key -out ca.pem -days 2 -subj /CN=ca 2>/dev/null",
        "openssl req -newkey rsa:2048 -nodes -keyout s.key -out s.csr -subj /CN=localhost 2>/dev/null",
        "printf 'subjectAltName=DNS:localhost' > ext && openssl x509 -req -in s.csr -CA ca.pem -CAkey ca.key "
        "-CAcreateserial -days 2 -extfile ext -out s.pem 2>/dev/null"};
    for (const char* command : commands) ASSERT_EQ(std::system((in + command).c_str()), 0) << command;
  }
};

TEST_F(SecurityTest, TokensAreNeededOnceThereIsOneAndScopesAreKept) {
  Farm farm(OptionsHere());
  AddToken(farm, "ann-token", "ann", 1 | 4, 0);
  AddToken(farm, "bob-token", "bob", 1 | 4, 0);
  AddToken(farm, "old-token", "old", 15, 5);
  AddToken(farm, "root-token", "root", 8 | 4 | 1, 0);
  EXPECT_EQ(farm.Client()->Get(1).status().code(), absl::StatusCode::kUnauthenticated);
  EXPECT_EQ(farm.Client("wrong")->Get(1).status().code(), absl::StatusCode::kUnauthenticated);
  EXPECT_EQ(farm.Client("old-token")->Get(1).status().code(), absl::StatusCode::kUnauthenticated);
  const auto job = farm.Client("ann-token")->Submit(scene.Text(), {});
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_TRUE(farm.Client("ann-token")->Get(job->job_id()).ok());
  // Of others' jobs one does not even learn that they are there.
  EXPECT_EQ(farm.Client("bob-token")->Get(job->job_id()).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(farm.Client("bob-token")->Cancel(job->job_id()).status().code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(farm.Client("root-token")->Get(job->job_id()).ok());
  EXPECT_EQ(farm.Client("ann-token")->CollectGarbage(0, seconds(1)).status().code(),
            absl::StatusCode::kPermissionDenied);
  const auto blob = DownloadBlob(*farm.Connect("ann-token"), Sha256Of(scene.Text()), 1000, 1);
  EXPECT_EQ(blob.status().code(), absl::StatusCode::kPermissionDenied);
  EXPECT_GE(farm.server().refused(), 5u);
  // The log says who was refused, and none of the secrets.
  EXPECT_GT(LinesWith("UNAUTHENTICATED"), 0);
  for (const char* secret : {"ann-token", "bob-token", "old-token", "root-token", "wrong"}) {
    EXPECT_EQ(LinesWith(secret), 0) << secret;
  }
}

TEST_F(SecurityTest, TokensLieInTheDatabaseAsHashesOnly) {
  Farm farm(OptionsHere());
  AddToken(farm, "very-secret-token", "ann", 15, 0);
  farm.StopCoordinator();
  for (const auto& file : std::filesystem::directory_iterator(dir.path() / "farm")) {
    if (!file.is_regular_file()) continue;
    std::ifstream in(file.path(), std::ios::binary);
    const std::string bytes(std::istreambuf_iterator<char>(in), {});
    EXPECT_EQ(bytes.find("very-secret-token"), std::string::npos) << file.path();
  }
  farm.StartCoordinator();
}

TEST_F(SecurityTest, BeyondLoopbackNothingIsServedWithoutTlsAndToken) {
  Farm farm(OptionsHere());
  rpc::ServerOptions open;
  open.listen = "0.0.0.0:0";
  EXPECT_EQ(rpc::FarmServer::Start(farm.coordinator(), open).status().code(), absl::StatusCode::kFailedPrecondition);
  open.allow_plain_text = true;
  EXPECT_EQ(rpc::FarmServer::Start(farm.coordinator(), open).status().code(), absl::StatusCode::kFailedPrecondition);
  AddToken(farm, "t", "ann", 15, 0);
  EXPECT_TRUE(rpc::FarmServer::Start(farm.coordinator(), open).ok());
  ConnectOptions plain;
  plain.address = "farm.example:7717";
  plain.token = "t";
  EXPECT_EQ(Connection::Open(plain).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(SecurityTest, MutualTlsLetsInWhoShowsACertificate) {
  MakeCertificates();
  Farm::Options options = OptionsHere();
  options.server.cert_file = dir.path() / "s.pem";
  options.server.key_file = dir.path() / "s.key";
  options.server.client_ca_file = dir.path() / "ca.pem";
  Farm farm(options);
  ConnectOptions connect;
  connect.address = farm.address();
  connect.ca_file = dir.path() / "ca.pem";
  EXPECT_FALSE(FarmClient(*Connection::Open(connect), milliseconds(200)).Status().ok());
  connect.cert_file = dir.path() / "s.pem";
  connect.key_file = dir.path() / "s.key";
  const auto status = FarmClient(*Connection::Open(connect), seconds(5)).Status();
  EXPECT_TRUE(status.ok()) << status.status();
}

TEST_F(SecurityTest, OversizedAndLyingUploadsAreRefused) {
  Farm::Options options = OptionsHere();
  options.server.max_blob_bytes = 1 << 20;
  Farm farm(options);
  const auto connection = farm.Connect();
  const std::string big(2 << 20, 'x');
  EXPECT_EQ(UploadBlob(*connection, Sha256Of(big), big).code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(UploadBlob(*connection, Sha256Of("a"), "b").code(), absl::StatusCode::kDataLoss);
  // More than declared, no digest, nothing at all.
  const auto stub = v1::BlobService::NewStub(connection->channel());
  const auto send = [&](std::vector<v1::UploadRequest> requests) {
    grpc::ClientContext context;
    v1::UploadResponse response;
    const auto writer = stub->Upload(&context, &response);
    for (const v1::UploadRequest& request : requests) writer->Write(request);
    writer->WritesDone();
    return writer->Finish().error_code();
  };
  v1::UploadRequest more;
  more.set_digest(DigestToBytes(Sha256Of("abc")));
  more.set_size_bytes(1);
  more.set_data("abc");
  EXPECT_EQ(send({more}), grpc::INVALID_ARGUMENT);
  EXPECT_EQ(send({v1::UploadRequest()}), grpc::INVALID_ARGUMENT);
  EXPECT_EQ(send({}), grpc::INVALID_ARGUMENT);
  EXPECT_TRUE(std::filesystem::is_empty(dir.path() / "farm" / "incoming"));
  farm.AddWorker("w");
  EXPECT_EQ(farm.Bake(scene).state(), v1::DONE);
}

TEST_F(SecurityTest, RandomBytesAsMessagesAreRefusedAndTheServiceGoesOn) {
  Farm farm(OptionsHere());
  const auto client = farm.Client();
  std::minstd_rand random(5);
  for (int i = 0; i < 100; ++i) {
    std::string bytes(random() % 300, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    EXPECT_FALSE(client->Submit(bytes, {}).ok());
    EXPECT_FALSE(
        client->Submit(scene.Text() + bytes.substr(0, 1) + "synthetic", {bytes + "/", bytes, bytes, false}).ok());
  }
  // Raw sockets: not HTTP/2 at all.
  for (int i = 0; i < 50; ++i) {
    const int file = Socket(farm.port());
    ASSERT_GE(file, 0);
    std::string bytes(2000, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    if (i % 2 == 0) bytes.replace(0, 24, "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n");
    EXPECT_GT(send(file, bytes.data(), bytes.size(), MSG_NOSIGNAL), 0);
    close(file);
  }
  farm.AddWorker("w");
  EXPECT_EQ(farm.Bake(scene).state(), v1::DONE);
}

TEST_F(SecurityTest, ManyIdleConnectionsDoNotStopTheService) {
  Farm farm(OptionsHere());
  farm.AddWorker("w");
  std::vector<int> idle;
  for (int i = 0; i < 1000; ++i) {
    const int file = Socket(farm.port());
    if (file >= 0) idle.push_back(file);
  }
  EXPECT_GT(idle.size(), 900u);
  EXPECT_EQ(farm.Bake(scene).state(), v1::DONE);
  for (const int file : idle) close(file);
}

TEST_F(SecurityTest, SlowReaderHoldsNothingUp) {
  Farm farm(OptionsHere());
  farm.AddWorker("w");
  scene.bytes = 8 << 20;
  scene.width = 1;
  const v1::Job job = farm.Bake(scene);
  const auto stub = v1::BakeService::NewStub(farm.Connect()->channel());
  grpc::ClientContext context;
  v1::FetchRequest request;
  request.set_job_id(job.id());
  request.set_name("out");
  const auto slow = stub->Fetch(&context, request);
  v1::FetchChunk chunk;
  ASSERT_TRUE(slow->Read(&chunk));
  std::this_thread::sleep_for(milliseconds(300));
  scene.seed = 2;
  scene.bytes = 64;
  EXPECT_EQ(farm.Bake(scene).state(), v1::DONE);
  context.TryCancel();
  EXPECT_EQ(slow->Finish().error_code(), grpc::CANCELLED);
}

TEST_F(SecurityTest, PathTricksInNamesReachNoFile) {
  Farm farm(OptionsHere());
  farm.AddWorker("w");
  const v1::Job job = farm.Bake(scene);
  const auto client = farm.Client();
  v1::Artifact artifact = job.artifacts(0);
  for (const char* name : {"../../etc/passwd", "/etc/passwd", "..", "a/../../b"}) {
    artifact.set_name(name);
    EXPECT_EQ(client->Fetch(job.id(), artifact, dir.path() / "out").code(), absl::StatusCode::kDataLoss) << name;
    EXPECT_EQ(farm.coordinator().FindArtifact(job.id(), name).status().code(), absl::StatusCode::kNotFound) << name;
  }
}

}  // namespace
}  // namespace bakewell::test
