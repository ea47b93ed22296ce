// Progress on its way to a client that may read slowly.
#pragma once

#include <chrono>
#include <deque>
#include <optional>

#include "core/base/run_context.h"
#include "rilievo/v1/reconstruction.pb.h"

namespace rilievo {

// Holds at most one event a stage, however slowly they are taken; passes at most ten a second
// within a stage, and always its first and last.
class ProgressQueue {
 public:
  using Clock = std::chrono::steady_clock;

  // `start`: when the points were complete.
  void Queued(Clock::time_point start);
  void Report(const Progress& progress, Clock::time_point now);

  std::optional<v1::Progress> Pop();
  void Clear() { pending_.clear(); }

  // The stage reported last; kCheck before any.
  Stage stage() const { return stage_; }

 private:
  void Push(v1::Progress event);

  Clock::time_point start_{}, stage_start_{}, last_push_{};
  Stage stage_ = Stage::kCheck;
  bool begun_ = false;
  std::deque<v1::Progress> pending_;
};

}  // namespace rilievo
