#include "server/sched/scheduler.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace bakewell::sched {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr JobId kJob{1}, kOther{2};
constexpr WorkerId kAnn{11}, kBob{12}, kCid{13}, kDan{14};

class SchedulerTest : public testing::Test {
 protected:
  TaskId Add(JobId job, std::vector<TaskId> needs = {}, uint64_t order = 0) {
    return scheduler.AddTask(job, {0, order, seconds(1), 0, std::move(needs), false});
  }
  void AddWorkers(double measured_ratio = 0) {
    scheduler.SetSpeedRatio(0, measured_ratio);
    for (const WorkerId id : {kAnn, kBob, kCid, kDan}) scheduler.AddWorker(id, {1, INT64_MAX}, now);
  }
  Grant One(WorkerId worker) {
    const auto grants = scheduler.Lease(worker, 1, now);
    EXPECT_EQ(grants.size(), 1u);
    return grants.empty() ? Grant{} : grants[0];
  }
  bool None(WorkerId worker) { return scheduler.Lease(worker, 1, now).empty(); }
  int Count(Event::Kind kind) {
    int count = 0;
    for (const Event& event : scheduler.TakeEvents()) count += event.kind == kind;
    return count;
  }

  Scheduler scheduler{Options{}, LeaseToken{0}};
  Time now{seconds(1000)};
};

TEST_F(SchedulerTest, TaskWaitsForWhatItNeeds) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  const TaskId first = Add(kJob), second = Add(kJob, {first});
  const Grant grant = One(kAnn);
  EXPECT_EQ(grant.task, first);
  EXPECT_TRUE(None(kBob));
  EXPECT_EQ(scheduler.Complete(first, grant.token, now), Completion::kAccepted);
  EXPECT_EQ(One(kBob).task, second);
  scheduler.CheckConsistent();
}

TEST_F(SchedulerTest, JobIsDoneOnceAllTasksAreAndItIsClosed) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, true});
  const TaskId task = Add(kJob);
  scheduler.Complete(task, One(kAnn).token, now);
  EXPECT_EQ(Count(Event::Kind::kJobDone), 0);
  scheduler.CloseJob(kJob);
  EXPECT_EQ(Count(Event::Kind::kJobDone), 1);
}

TEST_F(SchedulerTest, InteractiveGoesBeforeBatch) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  scheduler.AddJob(kOther, {"bob", kInteractive, 1, false});
  Add(kJob);
  const TaskId urgent = Add(kOther);
  EXPECT_EQ(One(kAnn).task, urgent);
}

TEST_F(SchedulerTest, RaisedPriorityMovesQueuedTasks) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  scheduler.AddJob(kOther, {"ann", kBatch, 1, false});
  Add(kJob);
  const TaskId later = Add(kOther);
  scheduler.SetPriority(kOther, kInteractive);
  EXPECT_EQ(One(kAnn).task, later);
  scheduler.CheckConsistent();
}

TEST_F(SchedulerTest, UsersShareByWeight) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  scheduler.AddJob(kOther, {"bob", kBatch, 3, false});
  std::vector<TaskId> anns;
  for (int i = 0; i < 400; ++i) anns.push_back(Add(kJob));
  for (int i = 0; i < 400; ++i) Add(kOther);
  int for_ann = 0;
  for (int i = 0; i < 200; ++i) {
    const TaskId task = One(kAnn).task;
    for_ann += std::find(anns.begin(), anns.end(), task) != anns.end();
  }
  EXPECT_NEAR(for_ann, 50, 4);  // a quarter, give or take one round of whole tasks
}

TEST_F(SchedulerTest, IdleUserDoesNotSaveUpTime) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  for (int i = 0; i < 300; ++i) Add(kJob);
  for (int i = 0; i < 100; ++i) One(kAnn);
  scheduler.AddJob(kOther, {"bob", kBatch, 1, false});
  std::vector<TaskId> bobs;
  for (int i = 0; i < 300; ++i) bobs.push_back(Add(kOther));
  int for_bob = 0;
  for (int i = 0; i < 100; ++i) for_bob += std::count(bobs.begin(), bobs.end(), One(kAnn).task) > 0;
  EXPECT_NEAR(for_bob, 50, 2);
}

TEST_F(SchedulerTest, SilentWorkerLosesItsLeasesWithoutBlame) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  const TaskId task = Add(kJob);
  One(kAnn);
  now += seconds(10);
  for (const WorkerId id : {kBob, kCid, kDan}) scheduler.Heartbeat(id, now);
  now += seconds(6);
  EXPECT_LE(scheduler.NextDeadline(), now);
  scheduler.Tick(now);
  EXPECT_FALSE(scheduler.Heartbeat(kAnn, now));
  EXPECT_EQ(One(kBob).task, task);
  EXPECT_EQ(Count(Event::Kind::kLeaseLost), 1);
  scheduler.CheckConsistent();
}

TEST_F(SchedulerTest, LateCompletionOfALostLeaseCounts) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  const TaskId task = Add(kJob);
  const Grant lost = One(kAnn);
  now += seconds(20);
  scheduler.Tick(now);
  EXPECT_EQ(scheduler.Complete(task, lost.token, now), Completion::kAccepted);
  EXPECT_EQ(scheduler.Complete(task, lost.token, now), Completion::kAlreadyDone);
  scheduler.CheckConsistent();
}

TEST_F(SchedulerTest, CompletionRevokesTheOtherHolder) {
  AddWorkers(/*measured_ratio=*/1);
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  const TaskId task = Add(kJob);
  const Grant first = One(kAnn);
  now += seconds(3);
  const Grant second = One(kBob);
  EXPECT_EQ(second.task, task);
  EXPECT_GT(second.token, first.token);
  EXPECT_EQ(scheduler.Complete(task, second.token, now), Completion::kAccepted);
  EXPECT_EQ(Count(Event::Kind::kRevoked), 1);
  EXPECT_EQ(scheduler.leases(), 0u);
  scheduler.CheckConsistent();
}

TEST_F(SchedulerTest, StragglerIsNotDoubledWhileTheJobHasOtherWork) {
  AddWorkers(/*measured_ratio=*/1);
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  const TaskId slow = Add(kJob, {}, 0), other = Add(kJob, {}, 1);
  EXPECT_EQ(One(kAnn).task, slow);
  now += seconds(5);
  EXPECT_EQ(One(kBob).task, other);
  EXPECT_EQ(One(kCid).task, slow);
  EXPECT_TRUE(None(kAnn));  // never a third run, and never one's own
}

TEST_F(SchedulerTest, StaleTokenNeitherFailsNorReleases) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  const TaskId task = Add(kJob);
  const Grant lost = One(kAnn);
  now += seconds(20);
  scheduler.Tick(now);
  scheduler.AddWorker(WorkerId{20}, {1, INT64_MAX}, now);
  const Grant current = One(WorkerId{20});
  EXPECT_FALSE(scheduler.Fail(task, lost.token, FailureKind::kPermanent, now));
  EXPECT_FALSE(scheduler.Release(task, lost.token));
  EXPECT_EQ(scheduler.leases(), 1u);
  EXPECT_TRUE(scheduler.Release(task, current.token));
}

TEST_F(SchedulerTest, FailedTaskGoesToAnotherWorker) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  const TaskId task = Add(kJob);
  scheduler.Fail(task, One(kAnn).token, FailureKind::kRetry, now);
  EXPECT_TRUE(None(kAnn));
  EXPECT_EQ(One(kBob).task, task);
}

TEST_F(SchedulerTest, ThreeFailuresEndTheJob) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  const TaskId task = Add(kJob);
  for (const WorkerId id : {kAnn, kBob}) scheduler.Fail(task, One(id).token, FailureKind::kRetry, now);
  EXPECT_EQ(Count(Event::Kind::kJobFailed), 0);
  scheduler.Fail(task, One(kCid).token, FailureKind::kRetry, now);
  EXPECT_EQ(Count(Event::Kind::kJobFailed), 1);
}

TEST_F(SchedulerTest, LoneWorkerMayTryAgainAfterAPauseThatDoubles) {
  scheduler.AddWorker(kAnn, {1, INT64_MAX}, now);
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  const TaskId task = Add(kJob);
  for (const Time pause : {seconds(1), seconds(2), seconds(4)}) {
    scheduler.Fail(task, One(kAnn).token, FailureKind::kRetry, now);
    now += pause - milliseconds(1);
    EXPECT_TRUE(None(kAnn));
    now += milliseconds(1);
  }
  EXPECT_EQ(One(kAnn).task, task);
  scheduler.CheckConsistent();
}

// Symptom: one worker that failed a task three times in a row had used up the task's tries, though others came later.
TEST_F(SchedulerTest, RepeatedFailuresOfOneWorkerCountOnce) {
  scheduler.AddWorker(kAnn, {1, INT64_MAX}, now);
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  const TaskId task = Add(kJob);
  for (int i = 0; i < 5; ++i) {
    scheduler.Fail(task, One(kAnn).token, FailureKind::kRetry, now);
    now += seconds(64);
    scheduler.Heartbeat(kAnn, now);
  }
  EXPECT_EQ(Count(Event::Kind::kJobFailed), 0);
  scheduler.AddWorker(kBob, {1, INT64_MAX}, now);
  EXPECT_TRUE(None(kAnn));
  scheduler.Complete(task, One(kBob).token, now);
  EXPECT_EQ(Count(Event::Kind::kJobDone), 1);
}

TEST_F(SchedulerTest, TaskThatTheOnlyWorkerNeverManagesEndsTheJobAfterTenTries) {
  scheduler.AddWorker(kAnn, {1, INT64_MAX}, now);
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  const TaskId task = Add(kJob);
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(Count(Event::Kind::kJobFailed), 0);
    scheduler.Fail(task, One(kAnn).token, FailureKind::kRetry, now);
    now += seconds(700);  // also what five failures in a row cost the worker
    scheduler.Heartbeat(kAnn, now);
  }
  EXPECT_EQ(Count(Event::Kind::kJobFailed), 1);
}

TEST_F(SchedulerTest, PermanentFailureEndsTheJobAtOnce) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  const TaskId task = Add(kJob);
  scheduler.Fail(task, One(kAnn).token, FailureKind::kPermanent, now);
  EXPECT_EQ(Count(Event::Kind::kJobFailed), 1);
}

TEST_F(SchedulerTest, HangingWorkerIsTimedOutAndExcluded) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  const TaskId task = Add(kJob);
  const Grant grant = One(kAnn);
  for (int i = 0; i < 20; ++i) {
    now += seconds(10);
    for (const WorkerId id : {kAnn, kBob, kCid, kDan}) scheduler.Heartbeat(id, now);
    if (now < seconds(1000) + grant.run_limit) scheduler.Tick(now);
  }
  scheduler.Tick(now);
  EXPECT_GE(Count(Event::Kind::kLeaseTimeout), 1);
  EXPECT_TRUE(None(kAnn));
  EXPECT_EQ(One(kBob).task, task);
}

TEST_F(SchedulerTest, WorkerThatAlwaysFailsRests) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  for (int i = 0; i < 10; ++i) Add(kJob, {}, i);
  for (int i = 0; i < 5; ++i) {
    const Grant grant = One(kAnn);
    scheduler.Fail(grant.task, grant.token, FailureKind::kRetry, now);
  }
  EXPECT_EQ(Count(Event::Kind::kWorkerRests), 1);
  EXPECT_TRUE(None(kAnn));
  EXPECT_FALSE(scheduler.MayLease(kAnn, now));
  now += seconds(11);
  One(kAnn);
}

TEST_F(SchedulerTest, PoisonTaskThatKillsWorkersEndsTheJob) {
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  Add(kJob);
  int failed = 0;
  for (int i = 0; i < 20 && failed == 0; ++i) {
    const WorkerId id{100u + i};
    scheduler.AddWorker(id, {1, INT64_MAX}, now);
    One(id);
    now += seconds(16);
    scheduler.Tick(now);
    failed = Count(Event::Kind::kJobFailed);
  }
  EXPECT_EQ(failed, 1);
}

TEST_F(SchedulerTest, CapabilityAndMemoryAreMatched) {
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  scheduler.AddWorker(kAnn, {0b01, INT64_MAX}, now);
  scheduler.AddWorker(kBob, {0b10, 100 << 20}, now);
  scheduler.AddWorker(kCid, {0b10, int64_t{8} << 30}, now);
  const TaskId big = scheduler.AddTask(kJob, {1, 0, seconds(1), int64_t{1} << 30, {}, false});
  EXPECT_TRUE(None(kAnn));
  EXPECT_TRUE(None(kBob));
  EXPECT_EQ(One(kCid).task, big);
}

TEST_F(SchedulerTest, WorkerIsHandedWhatItsResultMadeReady) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  std::vector<TaskId> first, second;
  for (int i = 0; i < 4; ++i) first.push_back(Add(kJob, {}, i));
  for (int i = 0; i < 4; ++i) second.push_back(Add(kJob, {first[i]}, 10 + i));
  const auto anns = scheduler.Lease(kAnn, 2, now), bobs = scheduler.Lease(kBob, 2, now);
  for (const Grant& grant : anns) scheduler.Complete(grant.task, grant.token, now);
  for (const Grant& grant : bobs) scheduler.Complete(grant.task, grant.token, now);
  const Grant next = One(kBob);
  EXPECT_TRUE(next.task == second[2] || next.task == second[3]);
}

TEST_F(SchedulerTest, DrainingWorkerGetsNothing) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  Add(kJob);
  scheduler.SetDraining(kAnn, true);
  EXPECT_TRUE(None(kAnn));
  scheduler.SetDraining(kAnn, false);
  One(kAnn);
}

TEST_F(SchedulerTest, RemovedWorkerGivesItsLeasesBack) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  Add(kJob);
  One(kAnn);
  scheduler.RemoveWorker(kAnn);
  EXPECT_EQ(scheduler.leases(), 0u);
  EXPECT_EQ(scheduler.ready(), 1u);
  One(kBob);
  scheduler.CheckConsistent();
}

TEST_F(SchedulerTest, CancelFreesWorkersButKeepsWhatOthersWant) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  scheduler.AddJob(kOther, {"bob", kBatch, 1, false});
  const TaskId mine = Add(kJob), shared = Add(kJob);
  scheduler.JoinTask(kOther, shared);
  One(kAnn);
  One(kBob);
  scheduler.CancelJob(kJob);
  const auto events = scheduler.TakeEvents();
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].kind, Event::Kind::kRevoked);
  EXPECT_EQ(events[0].task, mine);
  EXPECT_EQ(scheduler.leases(), 1u);
  EXPECT_EQ(scheduler.RunningOf(kOther), 1u);
  scheduler.CheckConsistent();
}

TEST_F(SchedulerTest, SharedTaskRunsOnceWithTheBetterPriority) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  const TaskId before = Add(kJob, {}, 0), shared = Add(kJob, {}, 1);
  scheduler.AddJob(kOther, {"bob", kInteractive, 1, false});
  scheduler.JoinTask(kOther, shared);
  EXPECT_EQ(One(kAnn).task, shared);
  EXPECT_EQ(One(kBob).task, before);
  EXPECT_TRUE(None(kCid));
}

TEST_F(SchedulerTest, AdoptedLeaseKeepsTheTaskFromOthers) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  const TaskId task = Add(kJob);
  EXPECT_EQ(scheduler.Adopt(kAnn, task, now).size(), 1u);
  EXPECT_TRUE(scheduler.Adopt(kBob, task, now).empty());
  EXPECT_TRUE(None(kBob));
}

TEST_F(SchedulerTest, ReopenedTaskRunsAgainBeforeWhatNeedsIt) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  const TaskId first = Add(kJob), second = Add(kJob, {first}), third = Add(kJob, {first});
  scheduler.Complete(first, One(kAnn).token, now);
  EXPECT_EQ(One(kAnn).task, second);
  scheduler.Reopen(first);
  scheduler.CheckConsistent();
  EXPECT_EQ(Count(Event::Kind::kRevoked), 1);
  const Grant again = One(kBob);
  EXPECT_EQ(again.task, first);
  EXPECT_TRUE(None(kCid));
  scheduler.Complete(first, again.token, now);
  EXPECT_NE(One(kCid).task, One(kDan).task);
  EXPECT_EQ(scheduler.RemainingOf(kJob), 2u);
  (void)third;
}

TEST_F(SchedulerTest, TokensRiseOverARestart) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  Add(kJob);
  const LeaseToken before = One(kAnn).token;
  Scheduler after(Options{}, LeaseToken{uint64_t{1} << 32});
  EXPECT_GT(after.last_token(), before);
}

// Symptom: on a machine that others use too the last tasks of each stage were run twice, since they took longer than
// planned, as all the tasks before them had.
TEST_F(SchedulerTest, SlowMachineMakesNoStragglers) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  for (int i = 0; i < 3; ++i) Add(kJob);
  const Grant first = One(kAnn), second = One(kBob);
  now += seconds(10);
  scheduler.Complete(first.task, first.token, now);
  scheduler.Complete(second.task, second.token, now);
  One(kAnn);
  now += seconds(9);
  EXPECT_TRUE(None(kBob));
  now += seconds(12);
  EXPECT_EQ(scheduler.Lease(kBob, 1, now).size(), 1u) << "twice as long as the others is long";
}

// Symptom: on a busy machine the only task of a kind was run a second time, since it took twice what was planned.
TEST_F(SchedulerTest, FirstOfItsKindIsNoStraggler) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  Add(kJob);
  One(kAnn);
  EXPECT_TRUE(scheduler.Lease(kBob, 1, now + seconds(9)).empty());
  EXPECT_EQ(scheduler.Lease(kBob, 1, now + seconds(29)).size(), 1u) << "that is too long for any guess";
}

TEST_F(SchedulerTest, MeasuredRunTimeSetsTheExpectation) {
  AddWorkers();
  scheduler.AddJob(kJob, {"ann", kBatch, 1, false});
  for (int i = 0; i < 100; ++i) Add(kJob);
  for (int i = 0; i < 60; ++i) {
    const Grant grant = One(kAnn);
    now += seconds(4);
    scheduler.Heartbeat(kAnn, now);
    scheduler.Complete(grant.task, grant.token, now);
  }
  EXPECT_NEAR(scheduler.SpeedRatio(0), 4.0, 0.05);
}

}  // namespace
}  // namespace bakewell::sched
