#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "core/artifact/task.h"
#include "core/base/status.h"
#include "proto/bakewell/v1/admin.pb.h"
#include "proto/bakewell/v1/bake.pb.h"
#include "proto/rpc/channel.h"

namespace bakewell {

struct SubmitOptions {
  std::string client_key;  // empty: made from random bytes
  std::string name;
  std::string settings;  // a serialised v1::BakeSettings
  bool interactive = false;
};

// A program's view of a coordinator. Calls block. Where the coordinator restarts or the network breaks they go on by
// themselves, for up to `patience`; then kUnavailable. Thread safe.
class FarmClient {
 public:
  explicit FarmClient(std::shared_ptr<Connection> connection,
                      std::chrono::milliseconds patience = std::chrono::seconds(60));
  ~FarmClient();

  // Uploads the scene if the coordinator lacks it, and submits. Safe to repeat with the same client_key.
  absl::StatusOr<v1::SubmitResponse> Submit(std::string_view scene, const SubmitOptions& options);
  absl::StatusOr<v1::EstimateResponse> Estimate(std::string_view scene, const SubmitOptions& options);
  absl::StatusOr<v1::Job> Get(int64_t job);
  // Every job that the filter lets through, over all pages, newest first, at most `limit`.
  absl::StatusOr<std::vector<v1::Job>> List(const v1::ListRequest& filter, int limit);
  absl::StatusOr<v1::Job> Cancel(int64_t job);

  // Calls `changed` with the job now and at every change, until it has ended; the job as it ended. `changed` returns
  // false to stop watching: kCancelled.
  absl::StatusOr<v1::Job> Watch(int64_t job, const std::function<bool(const v1::Job&)>& changed);

  // Ends every Watch() of this client, now and later, with kCancelled.
  void StopWatching();

  // Writes an artifact to FOLDER/NAME, whole or not at all: to a ".part" file, which a later call resumes, verified,
  // synced and renamed. A file that is there and right is left alone. Names from the wire that are not plain paths are
  // refused (kDataLoss).
  absl::Status Fetch(int64_t job, const v1::Artifact& artifact, const std::filesystem::path& folder);
  // All of the job's artifacts.
  absl::Status FetchAll(const v1::Job& job, const std::filesystem::path& folder);

  // Writes a picture that fills in to FOLDER/NAME, as it is now. kNotFound once its job has ended.
  absl::Status FetchPreview(int64_t job, const v1::Preview& preview, const std::filesystem::path& folder);

  absl::StatusOr<v1::ListWorkersResponse> Workers();
  absl::StatusOr<v1::StatusResponse> Status();
  absl::Status DrainWorker(uint64_t worker, bool draining);
  absl::Status SetPriority(int64_t job, int priority);
  absl::Status SetQuota(const v1::SetQuotaRequest& quota);
  absl::StatusOr<v1::CollectGarbageResponse> CollectGarbage(int64_t target_bytes, std::chrono::microseconds grace);

 private:
  // The deadline of a call: patience may be shorter than what the call would get.
  std::chrono::milliseconds CallTime() const;
  absl::Status Retry(const std::function<absl::Status()>& call);
  absl::Status UploadScene(std::string_view scene, const Digest& digest);
  absl::Status WatchOnce(int64_t job, const std::function<bool(const v1::Job&)>& changed, v1::Job& last);
  absl::Status FetchOnce(int64_t job, const std::string& name, const std::filesystem::path& part);

  struct Stubs;
  const std::shared_ptr<Connection> connection_;
  const std::chrono::milliseconds patience_;
  const std::unique_ptr<Stubs> stubs_;
  std::mutex mutex_;                         // guards what follows
  std::set<grpc::ClientContext*> watching_;  // calls under way
  bool stopped_ = false;
};

}  // namespace bakewell
