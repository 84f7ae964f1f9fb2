#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/base/status.h"
#include "server/store/tables.h"

namespace bakewell::store {

// The one thread that changes the database. What arrives while a transaction commits goes into the next one together
// (group commit), so that a thousand completions a second cost a few dozen syncs. Work is done in the order submitted.
//
// When the disk is full or the database busy, the batch is tried again until it fits: nothing is acknowledged
// meanwhile, nothing is lost, and Trouble() says why. Work that fails by itself (a constraint) is undone alone.
class Writer {
 public:
  using Work = std::function<absl::Status(Tables&)>;      // may run several times; changes nothing but the tables
  using Done = std::function<void(const absl::Status&)>;  // on the writer's thread, once, after the commit

  // While the disk refuses, a safe writer waits and tries again; one for scratch gives up what it was asked to write.
  explicit Writer(std::unique_ptr<Tables> tables, Durability durability = Durability::kSafe);
  // Writes what was submitted (unless the disk refuses), then ends the thread.
  ~Writer();

  void Submit(Work work, Done done = {});
  // Submits and waits.
  absl::Status Run(Work work);
  // The same, but does not wait while the disk refuses: kUnavailable says why, and nothing was written.
  absl::Status TryRun(Work work);

  size_t backlog() const { return backlog_.load(std::memory_order_relaxed); }
  // Commits and works since the start; commits << works shows the grouping.
  uint64_t commits() const { return commits_.load(std::memory_order_relaxed); }
  uint64_t works() const { return works_.load(std::memory_order_relaxed); }
  // Why nothing can be written now; OK if it can.
  absl::Status Trouble() const;

 private:
  struct Item {
    Work work;
    Done done;
    absl::Status result;
    bool patient = true;  // waits while the disk refuses
  };

  void Loop();
  std::vector<Item> TakeBatch();
  void WriteBatch(std::vector<Item>& batch);
  void Enqueue(Item item);
  // Answers the impatient among `items`, leaves the others, and says how many went.
  static size_t TurnAway(std::vector<Item>& items, const absl::Status& why);
  absl::Status TryBatch(std::vector<Item>& batch);

  std::unique_ptr<Tables> tables_;
  const Durability durability_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<Item> queue_;
  absl::Status trouble_;
  bool stopping_ = false;
  std::atomic<size_t> backlog_{0};
  std::atomic<uint64_t> commits_{0}, works_{0};
  std::thread thread_;
};

}  // namespace bakewell::store
