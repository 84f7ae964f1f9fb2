#include "tests/integration/hostile_targets.h"

#include <google/protobuf/message_lite.h>

#include <algorithm>
#include <random>

#include "core/base/fields.h"
#include "proto/bakewell/v1/admin.pb.h"
#include "proto/bakewell/v1/bake.pb.h"
#include "proto/bakewell/v1/blob.pb.h"
#include "proto/bakewell/v1/worker.pb.h"

namespace bakewell::test {

namespace {

std::string Text(const google::protobuf::MessageLite& message) { return message.SerializeAsString(); }

std::vector<Target> BlobTargets(const std::string& digest) {
  v1::FindMissingRequest find;
  find.add_digests(digest);
  v1::UploadRequest upload;
  upload.set_digest(digest);
  upload.set_size_bytes(10);
  upload.set_data("0123456789");
  v1::DownloadRequest download;
  download.set_digest(digest);
  return {{"BlobService/FindMissing", Text(find)},
          {"BlobService/Upload", Text(upload)},
          {"BlobService/Download", Text(download)}};
}

std::vector<Target> BakeTargets(const std::string& digest) {
  v1::SubmitRequest submit;
  submit.set_client_key("key");
  submit.set_scene(digest);
  v1::GetRequest get;
  get.set_job_id(1);
  v1::ListRequest list;
  list.set_page_size(10);
  list.set_page_token("5");
  v1::WatchRequest watch;
  watch.set_job_id(1);
  v1::CancelRequest cancel;
  cancel.set_job_id(1);
  v1::FetchRequest fetch;
  fetch.set_job_id(1);
  fetch.set_name("out");
  return {{"BakeService/Submit", Text(submit)}, {"BakeService/Estimate", Text(submit)},
          {"BakeService/Get", Text(get)},       {"BakeService/List", Text(list)},
          {"BakeService/Watch", Text(watch)},   {"BakeService/Cancel", Text(cancel)},
          {"BakeService/Fetch", Text(fetch)}};
}

std::vector<Target> WorkerTargets(const std::string& digest) {
  v1::RegisterRequest enroll;
  enroll.set_name("worker");
  enroll.set_cores(1);
  enroll.set_memory_bytes(1 << 20);
  enroll.add_capabilities()->set_kind("test/other");
  enroll.add_held()->set_key(digest);
  v1::LeaseRequest lease;
  lease.set_worker_id(4294967297);
  lease.set_add_credit(5);
  v1::HeartbeatRequest beat;
  beat.set_worker_id(4294967297);
  v1::CompleteRequest complete;
  complete.set_key(digest);
  complete.set_token(4294967297);
  v1::TaskOutput& output = *complete.add_outputs();
  output.set_name("out");
  output.set_digest(digest);
  output.set_size_bytes(20);
  v1::FailRequest fail;
  fail.set_key(digest);
  fail.set_code(13);
  fail.add_missing_inputs(digest);
  v1::ReleaseRequest release;
  release.add_leases()->set_key(digest);
  return {{"WorkerService/Register", Text(enroll)}, {"WorkerService/Lease", Text(lease)},
          {"WorkerService/Heartbeat", Text(beat)},  {"WorkerService/Complete", Text(complete)},
          {"WorkerService/Fail", Text(fail)},       {"WorkerService/Release", Text(release)}};
}

std::vector<Target> AdminTargets() {
  v1::DrainRequest drain;
  drain.set_worker_id(7);
  v1::SetPriorityRequest priority;
  priority.set_job_id(99);
  v1::SetQuotaRequest quota;
  quota.set_user("nobody");
  quota.set_weight(1);
  v1::CollectGarbageRequest collect;
  collect.set_target_bytes(1 << 30);
  return {{"AdminService/ListWorkers", ""},       {"AdminService/Status", ""},
          {"AdminService/Drain", Text(drain)},    {"AdminService/SetPriority", Text(priority)},
          {"AdminService/SetQuota", Text(quota)}, {"AdminService/CollectGarbage", Text(collect)}};
}

}  // namespace

std::vector<Target> Targets(const Digest& scene) {
  const std::string digest = DigestToBytes(scene);
  std::vector<Target> targets;
  for (const std::vector<Target>& some :
       {BlobTargets(digest), BakeTargets(digest), WorkerTargets(digest), AdminTargets()}) {
    for (const Target& target : some) targets.push_back({"/bakewell.v1." + target.method, target.valid});
  }
  return targets;
}

std::string Mutated(const std::string& valid, uint32_t seed) {
  std::minstd_rand random(seed);
  const auto any = [&](size_t below) { return static_cast<size_t>(random() >> 4) % std::max<size_t>(1, below); };
  std::string bytes = valid;
  if (seed % 4 == 0) {
    bytes.assign(any(200), '\0');
    for (char& byte : bytes) byte = static_cast<char>(any(256));
  }
  for (size_t left = any(4); left > 0; --left) {
    const size_t at = any(bytes.size());
    switch (any(5)) {
      case 0:
        bytes.resize(at);
        break;
      case 1:
        bytes += bytes.substr(at);
        break;
      case 2:
        bytes.insert(at, std::string(any(5), static_cast<char>(any(256))));
        break;
      default:
        if (at < bytes.size()) bytes[at] = static_cast<char>(any(256));
    }
  }
  return bytes;
}

}  // namespace bakewell::test
