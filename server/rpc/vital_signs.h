// Notices threads that got stuck.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/rpc/heartbeat.h"

namespace rilievo {

class VitalSigns {
 public:
  // Names and hearts, which outlive this object. `changed` is called on a thread of this object:
  // with false once one of them has been silent for `most`, with true when all beat again.
  VitalSigns(std::vector<std::pair<std::string, const Heartbeat*>> hearts,
             std::chrono::milliseconds most, std::function<void(bool alive)> changed);
  ~VitalSigns();

 private:
  void WatchUntil(const std::stop_token& stop);
  // The name of one that is silent; empty when all are well.
  std::string Silent() const;

  const std::vector<std::pair<std::string, const Heartbeat*>> hearts_;
  const std::chrono::milliseconds most_;
  const std::function<void(bool)> changed_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::jthread thread_;
};

}  // namespace rilievo
