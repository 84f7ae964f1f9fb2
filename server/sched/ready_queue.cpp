#include "server/sched/ready_queue.h"

#include <algorithm>
#include <tuple>

#include "core/base/check.h"

namespace bakewell::sched {

bool ReadyQueue::Rank::operator<(const Rank& other) const {
  return std::tuple(-priority, had, user) < std::tuple(-other.priority, other.had, other.user);
}

bool ReadyQueue::Candidate::operator<(const Candidate& other) const {
  return std::tuple(!at, sequence, entry) < std::tuple(!other.at, other.sequence, other.entry);
}

void ReadyQueue::AddJob(JobId job, const JobInfo& info) {
  const auto [found, added] = user_index_.try_emplace(info.user, static_cast<int>(users_.size()));
  if (added) users_.emplace_back();
  const Job entry{found->second, info.priority, std::max<int64_t>(1, info.weight), next_sequence_++, 0};
  BAKEWELL_CHECK(jobs_.try_emplace(job, entry).second);
}

void ReadyQueue::SetPriority(JobId job, int priority) {
  Job& entry = jobs_.at(job);
  BAKEWELL_CHECK_OP(entry.ready, ==, 0u);
  entry.priority = priority;
}

void ReadyQueue::RemoveJob(JobId job) {
  BAKEWELL_CHECK_OP(jobs_.at(job).ready, ==, 0u);
  jobs_.erase(job);
}

void ReadyQueue::Push(TaskId task, const Slot& slot) {
  Job& job = jobs_.at(slot.job);
  if (static_cast<size_t>(slot.class_index) >= classes_.size()) classes_.resize(slot.class_index + 1);
  User& user = users_[job.user];
  // A user who was idle does not save up the time: it starts level with those who were not.
  if (user.active.empty()) user.had = std::max(user.had, served_);
  user.active.insert({slot.class_index, job.priority});
  Bin& bin = classes_[slot.class_index].users[RankOf(job)][job.sequence];
  BAKEWELL_CHECK((slot.retry ? bin.retry : bin.fresh).insert({slot.order, task}).second);
  ++job.ready;
  ++classes_[slot.class_index].ready;
  ++size_;
}

void ReadyQueue::Remove(TaskId task, const Slot& slot) {
  Job& job = jobs_.at(slot.job);
  Class& in_class = classes_[slot.class_index];
  const auto bins = in_class.users.find(RankOf(job));
  BAKEWELL_CHECK(bins != in_class.users.end());
  const auto bin = bins->second.find(job.sequence);
  BAKEWELL_CHECK(bin != bins->second.end());
  BAKEWELL_CHECK_OP((slot.retry ? bin->second.retry : bin->second.fresh).erase({slot.order, task}), ==, 1u);
  if (bin->second.empty()) bins->second.erase(bin);
  if (bins->second.empty()) {
    in_class.users.erase(bins);
    users_[job.user].active.erase({slot.class_index, job.priority});
  }
  --job.ready;
  --in_class.ready;
  --size_;
}

void ReadyQueue::Charge(JobId job, Time work) {
  const Job& entry = jobs_.at(job);
  User& user = users_[entry.user];
  if (work > Time::zero()) served_ = std::max(served_, user.had);
  const Time had = std::max(Time::zero(), user.had + work / entry.weight);
  for (const auto& [class_index, priority] : user.active) {
    auto& ranked = classes_[class_index].users;
    auto node = ranked.extract(Rank{priority, user.had, entry.user});
    node.key().had = had;
    ranked.insert(std::move(node));
  }
  user.had = had;
}

std::optional<ReadyQueue::Entry> ReadyQueue::FirstOf(const Bin& bin, const std::function<bool(TaskId)>& may_retry) {
  // A task that failed before goes first where it may: it is what a job at its end waits for.
  for (const Entry& entry : bin.retry) {
    if (may_retry(entry.second)) return entry;
  }
  if (!bin.fresh.empty()) return *bin.fresh.begin();
  return std::nullopt;
}

std::optional<ReadyQueue::Candidate> ReadyQueue::BestOf(const UserBins& bins, uint64_t at_sequence,
                                                        const std::function<bool(TaskId)>& may_retry) const {
  if (const auto at = bins.find(at_sequence); at != bins.end()) {
    if (const auto entry = FirstOf(at->second, may_retry)) return Candidate{true, at_sequence, *entry};
  }
  for (const auto& [sequence, bin] : bins) {
    if (const auto entry = FirstOf(bin, may_retry)) return Candidate{false, sequence, *entry};
  }
  return std::nullopt;
}

std::optional<TaskId> ReadyQueue::Find(std::span<const int> classes, JobId at,
                                       const std::function<bool(TaskId)>& may_retry) const {
  struct Cursor {
    std::map<Rank, UserBins>::const_iterator next, end;
  };
  std::vector<Cursor> cursors;
  for (const int index : classes) {
    if (static_cast<size_t>(index) >= classes_.size()) continue;
    const auto& users = classes_[index].users;
    if (!users.empty()) cursors.push_back({users.begin(), users.end()});
  }
  const auto at_job = jobs_.find(at);
  const uint64_t at_sequence = at_job == jobs_.end() ? 0 : at_job->second.sequence;

  // Merge the classes by rank; what has equal rank belongs to one user, whose best task is taken.
  while (!cursors.empty()) {
    const Rank rank = std::min_element(cursors.begin(), cursors.end(), [](const Cursor& a, const Cursor& b) {
                        return a.next->first < b.next->first;
                      })->next->first;
    std::optional<Candidate> best;
    for (Cursor& cursor : cursors) {
      if (!(cursor.next->first == rank)) continue;
      const auto candidate = BestOf(cursor.next->second, at_sequence, may_retry);
      if (candidate && (!best || *candidate < *best)) best = candidate;
      ++cursor.next;
    }
    if (best) return best->entry.second;
    std::erase_if(cursors, [](const Cursor& cursor) { return cursor.next == cursor.end; });
  }
  return std::nullopt;
}

size_t ReadyQueue::ReadyOfClass(int class_index) const {
  return static_cast<size_t>(class_index) < classes_.size() ? classes_[class_index].ready : 0;
}

std::vector<std::pair<TaskId, ReadyQueue::Slot>> ReadyQueue::QueuedOf(JobId job) const {
  std::vector<std::pair<TaskId, Slot>> queued;
  const Job& entry = jobs_.at(job);
  for (size_t index = 0; index < classes_.size(); ++index) {
    const auto bins = classes_[index].users.find(RankOf(entry));
    if (bins == classes_[index].users.end()) continue;
    const auto bin = bins->second.find(entry.sequence);
    if (bin == bins->second.end()) continue;
    const int class_index = static_cast<int>(index);
    for (const auto& [order, task] : bin->second.fresh) queued.push_back({task, {job, class_index, order, false}});
    for (const auto& [order, task] : bin->second.retry) queued.push_back({task, {job, class_index, order, true}});
  }
  return queued;
}

}  // namespace bakewell::sched
