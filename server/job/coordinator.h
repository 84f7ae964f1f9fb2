#pragma once

#include <absl/container/flat_hash_map.h>

#include <memory>

#include "server/job/collector.h"
#include "server/job/learnt_costs.h"
#include "server/job/options.h"
#include "server/job/state.h"
#include "server/job/types.h"
#include "server/job/watch_list.h"
#include "server/sched/scheduler.h"
#include "server/store/blobs.h"
#include "server/store/io_pool.h"

namespace bakewell::job {

// The farm's memory and will: it joins the planner (what is to be done), the scheduler (who does it when) and the store
// (what is safe). Thread safe. After a crash, Open() on the same folder goes on where the last acknowledged change was.
//
// One mutex guards the state machine; it is never held across disk or network. Whatever is acknowledged was committed:
// replies come from the writer's thread after the commit.
class Coordinator {
 public:
  static absl::StatusOr<std::unique_ptr<Coordinator>> Open(Options options, const plan::Planner& planner);
  ~Coordinator();

  // --- jobs (blocking on disk: call from io()) ---
  absl::StatusOr<SubmitResult> Submit(const SubmitRequest& request);
  absl::StatusOr<Estimate> EstimateCost(const SubmitRequest& request);
  absl::StatusOr<JobView> Get(int64_t id);
  absl::StatusOr<std::vector<JobView>> List(const store::JobFilter& filter);
  absl::Status Cancel(int64_t id);
  absl::Status SetPriority(int64_t id, int priority);
  absl::Status SetAccount(const store::AccountRow& account);
  absl::StatusOr<std::vector<store::FailureRow>> Failures(int64_t job, int limit);
  // kNotFound, or kDataLoss if the bytes were lost: submit again.
  absl::StatusOr<TaskOutput> FindArtifact(int64_t id, std::string_view name);
  // SerializePreview() blobs of a running job's picture, from the `first` on. kNotFound.
  absl::StatusOr<std::vector<Digest>> PreviewParts(int64_t id, std::string_view picture, size_t first);

  WatchList& watches() { return watches_; }  // notified at most ten times a second, and when a job ends
  // The bits of the kinds and versions that this farm plans.
  uint64_t CapabilitiesOf(const std::vector<plan::Kind>& kinds) const;
  const std::vector<plan::Kind>& kinds() const { return kinds_; }
  sched::WorkerId AddWorker(const WorkerDescription& about);
  // Leases for tasks that the worker is at since before a restart.
  std::vector<TaskLease> Adopt(sched::WorkerId worker, const std::vector<TaskKey>& held);
  // False from these: the worker is not known, it must register.
  bool Heartbeat(sched::WorkerId worker);
  // Names the connection, 0: worker not known. A newer connection takes an older one's place.
  uint64_t Connect(sched::WorkerId worker, LeaseSink sink);
  // The connection's sink is not called any more when this returns.
  void Disconnect(sched::WorkerId worker, uint64_t connection);
  bool AddCredit(sched::WorkerId worker, int credit);
  bool Drain(sched::WorkerId worker, bool draining);
  void RemoveWorker(sched::WorkerId worker);
  std::vector<WorkerView> Workers();
  // `done`: after the commit. kNotFound: an output's blob is missing; kAborted: other outputs are known.
  void Complete(const CompletedTask& task, Done done);
  void Fail(const FailedTask& task);
  void Release(sched::WorkerId worker, const std::vector<std::pair<sched::LeaseToken, TaskKey>>& leases);

  store::BlobStore& blobs() { return *blobs_; }
  store::IoPool& io() { return io_; }
  Collector& collector() { return collector_; }
  store::Writer& writer() { return *writer_; }
  // Tells the database of a blob that has come; `done` after the commit.
  void RecordBlob(const Digest& digest, int64_t size_bytes, Done done);
  absl::StatusOr<std::optional<store::TokenRow>> FindToken(const Digest& hash);
  absl::StatusOr<int64_t> CountTokens();
  Stats GetStats();
  const Options& options() const { return options_; }
  int64_t WallNowUs() const { return options_.wall_now_us(); }

 private:
  using TaskId = sched::TaskId;
  using Lock = std::unique_lock<std::mutex>;
  struct Parts;
  Coordinator(Options options, const plan::Planner& planner, Parts parts);
  sched::Time Now() const { return options_.steady_now(); }

  absl::Status CheckRequest(const SubmitRequest& request);
  absl::Status CheckQuota(const SubmitRequest& request, const store::AccountRow& account);
  absl::StatusOr<store::AccountRow> AccountOf(const std::string& user);
  absl::StatusOr<std::vector<Stage>> PlanKnown(const plan::PlanRequest& request, std::vector<plan::TaskGraph> stages,
                                               std::optional<TaskOutputs> gate);
  absl::StatusOr<Stage> LookUp(plan::TaskGraph graph);
  absl::StatusOr<std::optional<store::KnownTask>> FindUsable(const TaskKey& key);
  void Activate(const store::JobRow& row, int64_t weight, std::vector<Stage> stages);
  void AddStage(Job& job, Stage stage);
  TaskId AddTask(Job& job, const plan::PlannedTask& planned, const std::optional<TaskOutputs>& known);
  void ContinueLater(int64_t id);
  absl::Status ContinueJob(int64_t id);
  void AddStages(int64_t id, absl::StatusOr<std::vector<Stage>> stages);
  absl::Status Recover();
  absl::Status RecoverJob(const store::JobRow& row);
  JobView ViewOf(const Job& job) const;
  TaskOutputs ArtifactsOf(const Job& job) const;
  void EndJob(int64_t id, store::JobState state, const absl::Status& reason, Done done);
  void ForgetTasks(int64_t id);
  void CountDone(Task& task);
  void HandleEvents();
  void Dispatch();
  void LeaseTo(sched::WorkerId id, Worker& worker);
  std::optional<TaskLease> Prepare(const sched::Grant& grant);
  TaskSpec Resolve(const TaskSpec& spec) const;
  bool FinishIfKnown(TaskId id, const TaskSpec& resolved, const sched::Grant& grant);
  void RememberResult(const Task& task, std::chrono::microseconds run, Done done);
  void CompleteAgain(const Task& task, const CompletedTask& completed, Done done);
  std::string WorkerName(sched::WorkerId id) const;
  void CountLost(Task& task);
  void CompleteForgotten(const CompletedTask& task, Done done);
  bool RemakeInputs(const FailedTask& failed);
  void NoteFailure(const Task& task, const std::string& worker, const std::string& reason);
  void Tick();
  void NotifyWatchers();
  Task& TaskOf(TaskId id) { return tasks_[static_cast<uint32_t>(id)]; }
  const Task& TaskOf(TaskId id) const { return tasks_[static_cast<uint32_t>(id)]; }

  Options options_;
  const plan::Planner& planner_;
  const std::vector<plan::Kind> kinds_;
  std::unique_ptr<store::BlobStore> blobs_;
  std::mutex reader_mutex_;
  std::unique_ptr<store::Tables> reader_;  // guarded by reader_mutex_

  mutable std::mutex mutex_;  // guards all that follows
  sched::Scheduler sched_;
  LearntCosts costs_;
  std::vector<Task> tasks_;  // by TaskId
  absl::flat_hash_map<TaskKey, TaskId, TaskKeyHash> by_key_;
  std::map<int64_t, Job> jobs_;  // running
  absl::flat_hash_map<sched::WorkerId, Worker> workers_;
  std::set<sched::WorkerId> hungry_;
  int64_t next_job_ = 1;
  uint64_t next_worker_ = 1, next_order_ = 0, next_connection_ = 1;
  Stats stats_;
  bool stopping_ = false, tick_now_ = false;

  WatchList watches_;
  std::unique_ptr<store::Writer> writer_;
  Collector collector_;
  store::IoPool io_;
  std::condition_variable tick_;
  std::thread ticker_;
};

}  // namespace bakewell::job
