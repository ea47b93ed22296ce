// How long each stage takes, and that it runs.
#pragma once

#include <chrono>

#include "core/base/run_context.h"
#include "core/pipeline/reconstruct.h"

namespace rilievo {

// Charges the time between its construction and destruction to one stage.
class StageTimer {
 public:
  StageTimer(Stage stage, const RunContext& context, ReconstructReport* report)
      : stage_(stage), context_(context), report_(report) {
    context_.Report(stage_, 0.0);
  }
  ~StageTimer() {
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
    report_->stage_seconds[static_cast<int>(stage_)] += elapsed.count();
    context_.Report(stage_, 1.0);
  }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  Stage stage_;
  const RunContext& context_;
  ReconstructReport* report_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace rilievo
