// Random histories of the scheduler: whatever workers do, every job ends, and the state never contradicts itself.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "server/sched/scheduler.h"

namespace bakewell::sched {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

class History {
 public:
  explicit History(uint32_t seed) : random_(seed) {}

  void Run(int steps) {
    for (int step = 0; step < steps; ++step) {
      now_ += milliseconds(Pick(800));
      Step();
      scheduler_.Tick(now_);
      Absorb();
      if (step % 16 == 0) scheduler_.CheckConsistent();
    }
  }

  // Only healthy workers from here on: everything left has to finish.
  void Settle() {
    const WorkerId worker = AddWorker(~uint64_t{0});
    for (int step = 0; step < 20000 && !unfinished_.empty(); ++step) {
      now_ += milliseconds(100);
      scheduler_.Heartbeat(worker, now_);
      scheduler_.Tick(now_);
      for (const Grant& grant : scheduler_.Lease(worker, 2, now_)) scheduler_.Complete(grant.task, grant.token, now_);
      Absorb();
    }
    scheduler_.CheckConsistent();
    EXPECT_TRUE(unfinished_.empty());
    EXPECT_EQ(scheduler_.tasks(), 0u);
    EXPECT_EQ(scheduler_.leases(), 0u);
    EXPECT_EQ(scheduler_.ready(), 0u);
  }

 private:
  uint32_t Pick(size_t below) {
    return std::uniform_int_distribution<uint32_t>(0, static_cast<uint32_t>(below) - 1)(random_);
  }

  WorkerId AddWorker(uint64_t capabilities) {
    const WorkerId id{next_worker_++};
    scheduler_.AddWorker(id, {capabilities, INT64_MAX}, now_);
    workers_.push_back(id);
    return id;
  }

  void AddJob() {
    const JobId job{next_job_++};
    scheduler_.AddJob(job,
                      {"user" + std::to_string(Pick(4)), Pick(4) == 0 ? kInteractive : kBatch, 1 + Pick(3), false});
    std::vector<TaskId> tasks;
    for (uint32_t i = 0, count = 1 + Pick(30); i < count; ++i) {
      TaskInfo info{static_cast<int>(Pick(3)), i, milliseconds(100 + Pick(2000)), 0, {}, Pick(10) == 0};
      for (uint32_t j = 0; j < Pick(4) && !tasks.empty(); ++j) info.needs.push_back(tasks[Pick(tasks.size())]);
      std::sort(info.needs.begin(), info.needs.end());
      info.needs.erase(std::unique(info.needs.begin(), info.needs.end()), info.needs.end());
      if (info.done) info.needs.clear();
      tasks.push_back(scheduler_.AddTask(job, info));
    }
    scheduler_.CloseJob(job);
    unfinished_.insert(job);
  }

  void Step() {
    switch (Pick(12)) {
      case 0:
        AddJob();
        break;
      case 1:
        AddWorker(1 + Pick(7));
        break;
      case 2:
        if (!unfinished_.empty() && Pick(3) == 0) Cancel();
        break;
      case 3:
        if (!workers_.empty()) scheduler_.RemoveWorker(TakeWorker());
        break;
      case 4:
        if (!unfinished_.empty()) scheduler_.SetPriority(AnyJob(), Pick(3) * 50);
        break;
      case 5:
        if (!workers_.empty()) scheduler_.SetDraining(workers_[Pick(workers_.size())], Pick(2) == 0);
        break;
      default:
        Work();
        break;
    }
    for (const WorkerId worker : workers_) {
      if (Pick(8) != 0) scheduler_.Heartbeat(worker, now_);
    }
  }

  JobId AnyJob() { return *std::next(unfinished_.begin(), Pick(unfinished_.size())); }

  WorkerId TakeWorker() {
    const size_t index = Pick(workers_.size());
    const WorkerId id = workers_[index];
    workers_.erase(workers_.begin() + index);
    return id;
  }

  void Cancel() {
    const JobId job = AnyJob();
    unfinished_.erase(job);
    Forget(job);
  }

  void Forget(JobId job) {
    for (const TaskId task : scheduler_.ForgetJob(job)) {
      std::erase_if(grants_, [&](const Grant& grant) { return grant.task == task; });
    }
  }

  // Leases something, and ends something that some worker holds or held.
  void Work() {
    if (workers_.empty()) return;
    for (const Grant& grant : scheduler_.Lease(workers_[Pick(workers_.size())], 1 + Pick(3), now_)) {
      EXPECT_GT(grant.token, last_token_);
      last_token_ = grant.token;
      EXPECT_FALSE(scheduler_.IsDone(grant.task));
      grants_.push_back(grant);
    }
    if (grants_.empty()) return;
    const size_t index = Pick(grants_.size());
    const Grant grant = grants_[index];
    switch (Pick(8)) {
      case 0:
        scheduler_.Fail(grant.task, grant.token, FailureKind::kRetry, now_);
        break;
      case 1:
        scheduler_.Release(grant.task, grant.token);
        break;
      default:
        scheduler_.Complete(grant.task, grant.token, now_);
        EXPECT_TRUE(scheduler_.IsDone(grant.task));
        break;
    }
    if (Pick(4) != 0) grants_.erase(grants_.begin() + index);  // else it will be ended again
  }

  void Absorb() {
    for (const Event& event : scheduler_.TakeEvents()) {
      if (event.kind != Event::Kind::kJobDone && event.kind != Event::Kind::kJobFailed) continue;
      if (unfinished_.erase(event.job) > 0) Forget(event.job);
    }
  }

  std::mt19937 random_;
  Scheduler scheduler_{Options{}, LeaseToken{0}};
  Time now_{seconds(5)};
  int64_t next_job_ = 1;
  uint64_t next_worker_ = 1;
  LeaseToken last_token_{0};
  std::vector<WorkerId> workers_;
  std::set<JobId> unfinished_;
  std::vector<Grant> grants_;
};

class SchedulerHistory : public testing::TestWithParam<uint32_t> {};

TEST_P(SchedulerHistory, EveryJobEndsAndNothingIsLeft) {
  History history(GetParam());
  history.Run(2000);
  history.Settle();
}

INSTANTIATE_TEST_SUITE_P(Seeds, SchedulerHistory, testing::Range(0u, 40u));

TEST(SchedulerHistory, SameCallsGiveSameGrants) {
  const auto grants = [] {
    Scheduler scheduler(Options{}, LeaseToken{0});
    scheduler.AddJob(JobId{1}, {"a", 0, 1, false});
    scheduler.AddJob(JobId{2}, {"b", 0, 2, false});
    for (uint64_t i = 0; i < 50; ++i) scheduler.AddTask(JobId(1 + i % 2), {0, i, seconds(1 + i % 3), 0, {}, false});
    scheduler.AddWorker(WorkerId{1}, {1, INT64_MAX}, Time(0));
    std::vector<TaskId> order;
    for (const Grant& grant : scheduler.Lease(WorkerId{1}, 50, Time(0))) order.push_back(grant.task);
    return order;
  };
  EXPECT_EQ(grants(), grants());
}

}  // namespace
}  // namespace bakewell::sched
