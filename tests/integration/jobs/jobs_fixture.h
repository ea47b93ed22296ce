// A rilievod with a store, on an address that it keeps when it is started again.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/library/jobs_client.h"
#include "client/library/reconstruction_client.h"
#include "core/pipeline/reconstruct.h"
#include "tests/integration/daemon/daemon_process.h"
#include "tests/integration/daemon/simulated_scans.h"
#include "tests/unit/server/store/test_folder.h"

namespace rilievo {

inline double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

class JobsTest : public testing::Test {
 protected:
  // With more arguments. The second time at the same port.
  void StartServer(std::vector<std::string> arguments = {}) {
    daemon_.reset();
    arguments.insert(arguments.end(), {"--store", test_ / "store"});
    if (!address_.empty()) arguments.insert(arguments.end(), {"--listen", address_});
    daemon_ = std::make_unique<DaemonProcess>(arguments);
    ASSERT_NE(daemon_->address(), "");
    address_ = daemon_->address();
  }

  void KillServer() {
    daemon_->Signal(SIGKILL);
    daemon_->WaitForExit(std::chrono::seconds(10));
  }

  std::shared_ptr<grpc::ChannelInterface> Channel() const { return ConnectPlaintext(address_); }

  // Patient: a server that is started again is waited for.
  JobsClient Client() const {
    return JobsClient(Channel(), {.attempts = 200,
                                  .first_pause = std::chrono::milliseconds(20),
                                  .longest_pause = std::chrono::milliseconds(300)});
  }

  // One that gives up at once.
  JobsClient HastyClient() const { return JobsClient(Channel(), {.attempts = 1}); }

  // The bytes that the library makes of it.
  static std::vector<uint8_t> Expected(const PointCloud& scan,
                                       const ReconstructOptions& options = {}) {
    return Reconstruct(scan, options, {})->encoded.Concatenate();
  }

  TestFolder test_;
  std::string address_;
  std::unique_ptr<DaemonProcess> daemon_;
};

}  // namespace rilievo
