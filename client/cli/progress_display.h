// What is going on, on standard error: a bar on a terminal, plain lines in a pipe.
#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <ostream>
#include <string>

namespace rilievo {

// Any method may be called from any thread.
class ProgressDisplay {
 public:
  enum class Style { kBar, kLines, kNone };

  // kBar when standard error is a terminal, else kLines.
  static Style StyleOfStandardError();

  ProgressDisplay(Style style, std::ostream& out);
  // Wipes an unfinished bar.
  ~ProgressDisplay();

  // Step `step` of `steps` (from 1), called `name`, is done to `fraction` of [0, 1]. A new step
  // ends the one before it. Bars are drawn at most 20 times a second. `left`: how long all of it
  // still takes, in words; empty where that is not known.
  void Update(int step, int steps, const std::string& name, double fraction,
              const std::string& left = "");

  // Ends the last step.
  void Finish();

 private:
  using Clock = std::chrono::steady_clock;

  void EndStep();
  void Draw(double fraction);
  void Wipe();

  const Style style_;
  std::ostream& out_;
  std::mutex mutex_;
  std::string name_;  // empty: no step yet
  std::string left_;
  int step_ = 0, steps_ = 0;
  size_t drawn_ = 0;  // characters of the bar on the line
  Clock::time_point step_began_, last_drawn_;
};

}  // namespace rilievo
