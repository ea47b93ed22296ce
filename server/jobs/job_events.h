// What happens to one job, for those who watch it.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "rilievo/v1/jobs.pb.h"

namespace rilievo {

// The number of the event that tells of a state. It follows from what is on disk, and progress
// takes the numbers in between, so that numbers grow over restarts of the server.
uint64_t SequenceOfState(v1::JobState state, uint32_t attempts);

// Thread-safe. Holds at most one event a stage and one a state, however many come: whoever reads
// slowly misses progress that is out of date, and costs nothing.
class JobEvents {
 public:
  // As far as is known of `job`: its state.
  explicit JobEvents(const v1::Job& job);

  // A new state, already on disk. Nothing is taken after a finished one.
  void Push(const v1::Job& job);
  void Push(v1::Progress progress);

  // What another server's worker told, with its number there: those who watch may go from server to
  // server. Nothing unless it is later than all that is known.
  void Follow(const v1::JobEvent& told);

  // The latest one, if that is of progress.
  std::optional<v1::JobEvent> LatestProgress() const;

  // No more will come, though the job is not finished: its watchers are to end with `reason`.
  void Close(const absl::Status& reason);

  // The first event after that number, if there is one yet.
  std::optional<v1::JobEvent> After(uint64_t sequence) const;

  // When nothing is left to come after that number: OK, or the reason of Close().
  std::optional<absl::Status> EndAfter(uint64_t sequence) const;

  // `notify` is called whenever something has changed, until Unwatch(key) returns; it must not call
  // back into this object.
  void Watch(const void* key, std::function<void()> notify);
  void Unwatch(const void* key);

 private:
  // With mutex_ held.
  void Append(v1::JobEvent event);
  void Notify() const;

  mutable std::mutex mutex_;
  uint64_t last_ = 0;
  std::vector<v1::JobEvent> events_;
  bool finished_ = false;
  std::optional<absl::Status> closed_;
  std::map<const void*, std::function<void()>> watchers_;
};

}  // namespace rilievo
