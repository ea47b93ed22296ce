// A bound on the lines that others can cause in a log.
#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>

namespace rilievo {

// Thread-safe.
class LineRate {
 public:
  using Clock = std::chrono::steady_clock;

  // So many in any second that begins with a line.
  explicit LineRate(int most) : most_(most) {}

  // How many lines were left out since the last one that passed; nothing when this one is left out.
  std::optional<uint64_t> Pass(Clock::time_point now);

 private:
  const int most_;
  std::mutex mutex_;
  Clock::time_point second_;
  int passed_ = 0;
  uint64_t left_out_ = 0;
};

}  // namespace rilievo
