// Whether this machine can work on jobs at all, by how its attempts went.
#pragma once

#include <chrono>
#include <functional>
#include <mutex>
#include <optional>

#include "absl/status/status.h"

namespace rilievo {

// Thread-safe.
class MachineHealth {
 public:
  // Takes how an attempt at a job ended: UNAVAILABLE is the machine's failure, see JobWork. Returns
  // for how long no job should begin: from 100 ms after the first failure in a row to 5 s from the
  // fourth on, 0 after an attempt that was the job's own; nothing where it tells neither.
  std::optional<std::chrono::milliseconds> Judge(const absl::Status& status);

  // Calls `on_change(able)` when it changes: false from the third failure in a row on, true again
  // after an attempt that was the job's own. An empty function ends that.
  void Watch(std::function<void(bool able)> on_change);

 private:
  std::mutex mutex_;
  int failures_ = 0;  // in a row
  std::function<void(bool)> on_change_;
};

}  // namespace rilievo
