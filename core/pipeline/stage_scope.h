// What the pipeline does around each stage: tell of it, time it, free memory for it.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>

#include "core/base/freed_memory.h"
#include "core/base/run_context.h"

namespace rilievo {

using StageSeconds = std::array<double, kStageCount>;

// The context of one run of the pipeline, for its stages.
struct PipelineContext : RunContext {
  StageSeconds* seconds = nullptr;  // summed up here; null: nowhere
  int64_t points = 0;               // of the scan

  // For what is done once more: progress has passed its stage.
  PipelineContext Silent() const {
    PipelineContext silent = *this;
    silent.progress = nullptr;
    return silent;
  }
};

// A stage, from construction to destruction. What the one before has left of freed memory goes
// back first.
class StageScope {
 public:
  // `done`: the share that an earlier run has done.
  StageScope(Stage stage, const PipelineContext& context, double done = 0)
      : stage_(stage), context_(context) {
    ReleaseToOsAfter(context_.points);
    context_.Report(stage_, done);
  }
  ~StageScope() {
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
    if (context_.seconds != nullptr) {
      (*context_.seconds)[static_cast<size_t>(stage_)] += elapsed.count();
    }
    context_.Report(stage_, 1.0);
  }
  StageScope(const StageScope&) = delete;
  StageScope& operator=(const StageScope&) = delete;

 private:
  Stage stage_;
  const PipelineContext& context_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace rilievo
