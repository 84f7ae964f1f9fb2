// A client that means harm: the service refuses, says so once, and goes on.
#include <absl/strings/str_cat.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <gtest/gtest.h>

#include "core/scene/canonical.h"
#include "proto/bakewell/v1/bake.grpc.pb.h"
#include "proto/bakewell/v1/blob.grpc.pb.h"
#include "proto/bakewell/v1/settings.pb.h"
#include "proto/bakewell/v1/worker.grpc.pb.h"
#include "proto/rpc/transfer.h"
#include "proto/settings.h"
#include "server/plan/level_planner.h"
#include "server/rpc/refusal_log.h"
#include "tests/integration/hostile_targets.h"
#include "tests/integration/logged_farm.h"
#include "tests/support/peak_memory.h"
#include "worker/rpc/farm_link.h"

namespace bakewell::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

using HostileTest = LoggedFarm;

// Sends one message of any bytes to any method, and reads until the call ends.
class RawCaller {
 public:
  explicit RawCaller(const std::shared_ptr<grpc::Channel>& channel, milliseconds patience = milliseconds(500))
      : stub_(channel), patience_(patience) {}

  grpc::StatusCode Call(const std::string& method, const std::string& bytes) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + patience_);
    const auto call = stub_.PrepareCall(&context, method, &queue_);
    const grpc::Slice slice(bytes.data(), bytes.size(), grpc::Slice::STATIC_SLICE);  // the call ends before they do
    const grpc::ByteBuffer message(&slice, 1);
    grpc::ByteBuffer answer;
    grpc::Status status;
    call->StartCall(this);
    bool alive = Next();
    if (alive) {
      call->WriteLast(message, grpc::WriteOptions(), this);
      alive = Next();
    }
    while (alive) {
      call->Read(&answer, this);
      alive = Next();
    }
    call->Finish(&status, this);
    Next();
    return status.error_code();
  }

 private:
  bool Next() {
    void* tag = nullptr;
    bool ok = false;
    return queue_.Next(&tag, &ok) && ok;
  }
  grpc::GenericStub stub_;
  const milliseconds patience_;
  grpc::CompletionQueue queue_;
};

TEST_F(HostileTest, MutatedMessagesToEveryMethodAreAnsweredAndTheServiceGoesOn) {
  Farm farm(OptionsHere());
  farm.AddWorker("w");
  const v1::Job before = farm.Bake(scene, "before");
  RawCaller caller(farm.Connect()->channel());
  const std::vector<Target> targets = Targets(Sha256Of(scene.Text()));
  std::map<grpc::StatusCode, int> codes;
  uint32_t seed = 0;
  for (int round = 0; round < 150; ++round) {
    for (const Target& target : targets) {
      const grpc::StatusCode code = caller.Call(target.method, Mutated(target.valid, ++seed));
      ++codes[code];
      ASSERT_NE(code, grpc::DEADLINE_EXCEEDED) << target.method << " with seed " << seed << " was not answered";
    }
  }
  EXPECT_EQ(codes[grpc::UNKNOWN], 0);
  EXPECT_EQ(codes[grpc::UNAVAILABLE], 0) << "a call broke the connection";
  EXPECT_GT(codes[grpc::OK], 100) << "too few messages were valid: they test the parser only";
  EXPECT_GT(codes[grpc::INVALID_ARGUMENT], 100);
  // Refusals are said once a minute and reason, not thousands of times.
  EXPECT_GE(LinesWith("refused"), 1);
  EXPECT_LE(LinesWith("refused"), 10);
  scene.seed = 77;
  EXPECT_EQ(farm.Bake(scene).state(), v1::DONE);
  EXPECT_EQ(DigestsOf(*farm.Client()->Get(before.id())), DigestsOf(before));
}

// Symptom: what a worker or client says was added, subtracted and summed up before it was looked at: overflow, which
// the sanitizers report and which made a worker's run time negative.
TEST_F(HostileTest, NumbersAtTheEndsOfTheirRangeAreHarmless) {
  Farm farm(OptionsHere());
  RawCaller caller(farm.Connect()->channel());
  FarmLink link(farm.Connect());
  const auto registered = link.Register({"liar", "", 1, 1 << 20, SyntheticExecutor().Kinds()}, {});
  ASSERT_TRUE(registered.ok()) << registered.status();
  for (const int32_t credit : {INT32_MAX, INT32_MIN}) {
    v1::LeaseRequest lease;
    lease.set_worker_id(registered->worker_id);
    lease.set_add_credit(credit);
    // The stream stays open; two messages add up.
    const auto stub = v1::WorkerService::NewStub(farm.Connect()->channel());
    grpc::ClientContext context;
    const auto stream = stub->Lease(&context);
    for (int i = 0; i < 3; ++i) ASSERT_TRUE(stream->Write(lease));
    stream->WritesDone();
    EXPECT_TRUE(stream->Finish().ok());
  }
  for (const int state : {INT32_MAX, INT32_MIN, 5}) {
    v1::ListRequest list;
    list.set_state(static_cast<v1::JobState>(state));
    EXPECT_EQ(caller.Call("/bakewell.v1.BakeService/List", list.SerializeAsString()), grpc::INVALID_ARGUMENT) << state;
  }
  for (const int64_t run : {INT64_MIN, INT64_MAX, INT64_MAX}) {
    ++scene.seed;
    const auto job = farm.Client()->Submit(scene.Text(), {});
    ASSERT_TRUE(job.ok()) << job.status();
    const plan::BlobReader read = [&](const Digest&) -> absl::StatusOr<std::string> { return scene.Text(); };
    const plan::PlannedTask root = SyntheticPlanner().Plan({Sha256Of(scene.Text()), ""}, read)->tasks[0];
    ASSERT_TRUE(UploadBlob(link.connection(), Sha256Of("x"), "x").ok());
    const absl::Status done = link.Complete(registered->worker_id, {0, root.key, root.spec, 0},
                                            {{"out", Sha256Of("x"), 1}}, std::chrono::microseconds(run));
    ASSERT_TRUE(done.ok()) << done;
    EXPECT_GE(farm.Client()->Get(job->job_id())->run_us(), 0);
    EXPECT_GE(farm.coordinator().GetStats().run_us, 0);
  }
}

// Symptom: a second Lease stream in a worker's name took the first one's place, ended, and the worker never heard of
// it: it waited for tasks for ever.
TEST_F(HostileTest, WorkerWhoseStreamIsTakenComesBack) {
  Farm farm(OptionsHere());
  farm.AddWorker("w");
  farm.Bake(scene);
  const auto workers = farm.Client()->Workers();
  ASSERT_TRUE(workers.ok()) << workers.status();
  v1::LeaseRequest thief;
  thief.set_worker_id(workers->workers(0).id());
  RawCaller(farm.Connect()->channel()).Call("/bakewell.v1.WorkerService/Lease", thief.SerializeAsString());
  scene.seed = 2;
  EXPECT_EQ(farm.Bake(scene).state(), v1::DONE);
}

TEST_F(HostileTest, MessagesAboveTheLimitAreRefused) {
  Farm farm(OptionsHere());
  RawCaller caller(farm.Connect()->channel());
  const std::string big(5 << 20, 'x');
  for (const Target& target : Targets(Digest{})) {
    EXPECT_EQ(caller.Call(target.method, big), grpc::RESOURCE_EXHAUSTED) << target.method;
  }
  farm.AddWorker("w");
  EXPECT_EQ(farm.Bake(scene).state(), v1::DONE);
}

// Symptom: 1 MiB that unpacks to 1 GiB passed the limit of 4 MiB, which gRPC holds against the packed size.
TEST_F(HostileTest, MessagesThatUnpackToGigabytesAreRefusedPacked) {
  Farm farm(OptionsHere());
  farm.AddWorker("w");
  const v1::Job before = farm.Bake(scene, "before");
  const std::string zeros(256 << 20, '\0');
  for (const grpc_compression_algorithm packing : {GRPC_COMPRESS_GZIP, GRPC_COMPRESS_DEFLATE}) {
    grpc::ChannelArguments arguments;
    arguments.SetCompressionAlgorithm(packing);
    arguments.SetMaxSendMessageSize(-1);
    const auto channel = grpc::CreateCustomChannel(farm.address(), grpc::InsecureChannelCredentials(), arguments);
    const PeakMemory memory;
    const grpc::StatusCode code = RawCaller(channel, seconds(20)).Call("/bakewell.v1.BlobService/Upload", zeros);
    EXPECT_TRUE(code == grpc::UNIMPLEMENTED || code == grpc::RESOURCE_EXHAUSTED) << code;
    // The bomb's maker, in this process too, packs it; the service must not unpack it.
    EXPECT_LT(memory.GrownMegabytes(), 128);
  }
  EXPECT_EQ(farm.Bake(scene, "after").state(), v1::DONE);
}

// A coordinator that packs 64 MiB into 64 KiB.
class PackingCoordinator final : public v1::BakeService::Service {
  grpc::Status Get(grpc::ServerContext* context, const v1::GetRequest*, v1::Job* job) override {
    context->set_compression_algorithm(GRPC_COMPRESS_GZIP);
    job->set_reason(std::string(64 << 20, 'x'));
    return {};
  }
};

TEST(HostileCoordinator, ItsPackedMessagesAreRefusedByTheClient) {
  PackingCoordinator service;
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("localhost:0", grpc::InsecureServerCredentials(), &port);
  builder.SetMaxSendMessageSize(-1);
  builder.RegisterService(&service);
  const auto server = builder.BuildAndStart();
  ConnectOptions options;
  options.address = absl::StrCat("localhost:", port);
  FarmClient client(Connection::Open(options).value(), seconds(10));
  const auto job = client.Get(1);
  ASSERT_FALSE(job.ok()) << job->reason().size();
  EXPECT_TRUE(absl::IsInternal(job.status()) || absl::IsUnimplemented(job.status())) << job.status();
  server->Shutdown();
}

// Symptom: an upload that stopped in the middle held its place among the transfers until its client went away.
TEST_F(HostileTest, StalledUploadsAndReadersEnd) {
  Farm::Options options = OptionsHere();
  options.server.stall_limit = milliseconds(400);
  Farm farm(options);
  farm.AddWorker("w");
  scene.bytes = 8 << 20;
  scene.width = 1;
  const v1::Job job = farm.Bake(scene);
  const auto connection = farm.Connect();
  const auto blobs = v1::BlobService::NewStub(connection->channel());
  grpc::ClientContext uploading;
  v1::UploadResponse response;
  const auto writer = blobs->Upload(&uploading, &response);
  v1::UploadRequest first;
  first.set_digest(DigestToBytes(Sha256Of("abc")));
  first.set_size_bytes(3);
  first.set_data("a");
  ASSERT_TRUE(writer->Write(first));
  const auto bakes = v1::BakeService::NewStub(connection->channel());
  grpc::ClientContext reading;
  v1::FetchRequest request;
  request.set_job_id(job.id());
  request.set_name("out");
  const auto reader = bakes->Fetch(&reading, request);
  // Neither client does anything; both calls end by themselves.
  EXPECT_TRUE(WaitFor([&] { return std::filesystem::is_empty(dir.path() / "farm" / "incoming"); }, seconds(5)));
  EXPECT_NE(writer->Finish().error_code(), grpc::OK);
  std::this_thread::sleep_for(milliseconds(1000));
  v1::FetchChunk chunk;
  while (reader->Read(&chunk)) {
  }
  EXPECT_EQ(reader->Finish().error_code(), grpc::CANCELLED);
  // One that is slow, but moves, is left alone.
  grpc::ClientContext slow;
  const auto slow_writer = blobs->Upload(&slow, &response);
  for (const char* part : {"a", "b", "c"}) {
    first.set_data(part);
    ASSERT_TRUE(slow_writer->Write(first));
    first.clear_digest();
    std::this_thread::sleep_for(milliseconds(200));
  }
  slow_writer->WritesDone();
  EXPECT_TRUE(slow_writer->Finish().ok());
}

TEST_F(HostileTest, SmallSceneThatAsksForBillionsOfTexelsIsRefusedAtSubmit) {
  Scene scene_of_one;
  Object floor;
  floor.lightmapped = true;
  floor.position = {{0, 0, 0}, {100, 0, 0}, {0, 0, 100}};
  floor.normal = {{0, 1, 0}, {0, 1, 0}, {0, 1, 0}};
  floor.uv0 = floor.uv1 = {{0, 0}, {1, 0}, {0, 1}};
  floor.index = {0, 1, 2};
  scene_of_one.materials.emplace_back();
  scene_of_one.objects.push_back(floor);
  const std::vector<std::byte> bytes = SerializeScene(scene_of_one);
  const std::string blob(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const plan::BlobReader read = [&](const Digest&) -> absl::StatusOr<std::string> { return blob; };
  const plan::LevelPlanner planner;
  BakeSettings settings;
  const auto plan = [&] { return planner.Plan({{}, ProtoFromSettings(settings).SerializeAsString()}, read).status(); };
  EXPECT_TRUE(plan().ok()) << plan();
  settings.resolution = 16384;
  EXPECT_EQ(plan().code(), absl::StatusCode::kResourceExhausted) << plan();
  settings.resolution = 0;
  settings.texels_per_metre = 1000;
  EXPECT_EQ(plan().code(), absl::StatusCode::kResourceExhausted) << plan();
}

// One vertex and 67 million triangles of it, as an instance count of a thousand millions would give them: 12 bytes each
// in the blob, hundreds in a worker.
TEST_F(HostileTest, MoreTrianglesThanALevelMayHaveAreRefusedAtSubmit) {
  Scene crowd;
  crowd.materials.emplace_back();
  Object& object = crowd.objects.emplace_back();
  object.lightmapped = true;
  object.position = object.normal = {{0, 1, 0}};
  object.uv0 = {{0, 0}};
  object.index.assign(3 * 1001, 0);
  const std::vector<std::byte> bytes = SerializeScene(crowd);
  const plan::BlobReader read = [&](const Digest&) -> absl::StatusOr<std::string> {
    return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  };
  const std::string settings = ProtoFromSettings({}).SerializeAsString();
  plan::LevelLimits limits;
  EXPECT_EQ(limits.max_triangles, 1 << 26);
  EXPECT_TRUE(plan::LevelPlanner(limits).Plan({{}, settings}, read).ok());
  limits.max_triangles = 1000;
  const absl::Status refused = plan::LevelPlanner(limits).Plan({{}, settings}, read).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted) << refused;
  EXPECT_NE(refused.message().find("1e+03 triangles"), std::string::npos) << refused;
}

TEST_F(HostileTest, SceneWhoseCountsLieIsRefusedWithoutMemory) {
  const plan::LevelPlanner planner;
  Scene one;
  one.materials.emplace_back();
  const std::vector<std::byte> bytes = SerializeScene(one);
  const std::string valid(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  // Every 32-bit word becomes a huge count in turn; what is refused is refused before anything is allocated for it.
  for (size_t at = 0; at + 4 <= valid.size(); ++at) {
    std::string blob = valid;
    for (size_t i = 0; i < 4; ++i) blob[at + i] = static_cast<char>(i == 3 ? 0x3f : 0xff);
    const plan::BlobReader read = [&](const Digest&) -> absl::StatusOr<std::string> { return blob; };
    const absl::Status status = planner.Plan({{}, ProtoFromSettings({}).SerializeAsString()}, read).status();
    EXPECT_TRUE(status.ok() || absl::IsInvalidArgument(status)) << at << " " << status;
  }
}

TEST(RefusalLog, SaysEachReasonOnceAMinuteAndCountsTheRest) {
  std::vector<std::string> lines;
  rpc::RefusalLog log([&](std::string_view line) { lines.emplace_back(line); });
  const absl::Status bad = absl::InvalidArgumentError("no\n\x1b[2Jsuch thing"),
                     wrong = absl::UnauthenticatedError("who?");
  int64_t now_us = 1'000'000'000;
  for (int i = 0; i < 1000; ++i) log.Note(absl::StrCat("ipv4:10.0.0.1:", i), bad, now_us);
  log.Note("ipv4:10.0.0.1:5", wrong, now_us);
  log.Note("ipv4:10.0.0.2:5", bad, now_us);
  log.Note("ipv4:10.0.0.1:5", absl::NotFoundError("not yet"), now_us);
  EXPECT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[0], "refused ipv4:10.0.0.1: INVALID_ARGUMENT: no\\n\\033[2Jsuch thing");
  now_us += 61'000'000;
  log.Note("ipv4:10.0.0.1:9", bad, now_us);
  ASSERT_EQ(lines.size(), 4u);
  EXPECT_NE(lines[3].find("(and 999 more since the last line)"), std::string::npos) << lines[3];
}

}  // namespace
}  // namespace bakewell::test
