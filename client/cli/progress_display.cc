#include "client/cli/progress_display.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "absl/strings/str_format.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

constexpr auto kRedraw = std::chrono::milliseconds(50);
constexpr double kShortestStep = 0.005;             // seconds
constexpr int kBarWidth = 34, kShortBarWidth = 15;  // the time left takes the room

}  // namespace

ProgressDisplay::Style ProgressDisplay::StyleOfStandardError() {
  return isatty(STDERR_FILENO) ? Style::kBar : Style::kLines;
}

ProgressDisplay::ProgressDisplay(Style style, std::ostream& out) : style_(style), out_(out) {}

ProgressDisplay::~ProgressDisplay() {
  const std::lock_guard lock(mutex_);
  Wipe();
}

void ProgressDisplay::Update(int step, int steps, const std::string& name, double fraction,
                             const std::string& left) {
  const std::lock_guard lock(mutex_);
  if (style_ == Style::kNone) return;
  if (name != name_) {
    EndStep();
    name_ = name;
    step_ = step;
    steps_ = steps;
    step_began_ = Clock::now();
    last_drawn_ = {};
  }
  left_ = left;
  if (style_ == Style::kBar && Clock::now() - last_drawn_ >= kRedraw) Draw(fraction);
}

void ProgressDisplay::Finish() {
  const std::lock_guard lock(mutex_);
  EndStep();
  Wipe();
}

void ProgressDisplay::EndStep() {
  if (name_.empty() || style_ != Style::kLines) return;
  const double seconds = std::chrono::duration<double>(Clock::now() - step_began_).count();
  // Steps that only announce themselves are not worth a line.
  if (seconds >= kShortestStep) {
    out_ << absl::StrFormat("[%d/%d] %-13s %7.2f s%s%s\n", step_, steps_, name_, seconds,
                            left_.empty() ? "" : ", ", left_);
    out_.flush();
  }
  name_.clear();
}

void ProgressDisplay::Draw(double fraction) {
  const double share = std::isfinite(fraction) ? std::clamp(fraction, 0.0, 1.0) : 0.0;
  const int width_of_bar = left_.empty() ? kBarWidth : kShortBarWidth;
  const int filled = static_cast<int>(share * width_of_bar);
  const double seconds = std::chrono::duration<double>(Clock::now() - step_began_).count();
  std::string line =
      absl::StrFormat("[%d/%d] %-13.20s [%s%s] %3d %% %6.1f s%s%s", step_, steps_, name_,
                      std::string(filled, '#'), std::string(width_of_bar - filled, '.'),
                      static_cast<int>(100 * share), seconds, left_.empty() ? "" : ", ", left_);
  line.resize(std::min(line.size(), kTextWidth - 1));
  const size_t width = line.size();
  if (drawn_ > width) line.append(drawn_ - width, ' ');
  out_ << '\r' << line;
  out_.flush();
  drawn_ = width;
  last_drawn_ = Clock::now();
}

void ProgressDisplay::Wipe() {
  if (drawn_ == 0) return;
  out_ << '\r' << std::string(drawn_, ' ') << '\r';
  out_.flush();
  drawn_ = 0;
}

}  // namespace rilievo
