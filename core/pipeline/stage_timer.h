// How long each stage takes, and that it runs.
#pragma once

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>

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
    if (getenv("RCPU"))
      fprintf(stderr, "RCPU %d %.2f %.2f\n", static_cast<int>(stage_),
              1e3 * (Cpu(CLOCK_PROCESS_CPUTIME_ID) - c0_),
              1e3 * (Cpu(CLOCK_THREAD_CPUTIME_ID) - t0_));
  }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  static double Cpu(clockid_t c) {
    timespec t;
    clock_gettime(c, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
  }
  double c0_ = Cpu(CLOCK_PROCESS_CPUTIME_ID), t0_ = Cpu(CLOCK_THREAD_CPUTIME_ID);
  Stage stage_;
  const RunContext& context_;
  ReconstructReport* report_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace rilievo
