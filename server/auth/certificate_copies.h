// Copies of the TLS files that change only from one good state to another.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace rilievo {

// gRPC reads the files of a certificate again by itself, and ends the process when it meets an
// empty one, as a copy under way leaves it. It is given these copies instead, which live in memory
// and follow the files when a check of all of them together finds nothing wrong.
class CertificateCopies {
 public:
  // Takes paths in the order of the files.
  using Check = std::function<absl::Status(const std::vector<std::string>& paths)>;

  // Looks at the files once a second on a thread of its own. Those with an empty path stay absent.
  // UNAVAILABLE when a file cannot be read or the system gives no memory for it.
  static absl::StatusOr<std::unique_ptr<CertificateCopies>> Watch(std::vector<std::string> files,
                                                                  Check check);
  ~CertificateCopies();
  CertificateCopies(const CertificateCopies&) = delete;
  CertificateCopies& operator=(const CertificateCopies&) = delete;

  // Of the copy of each file; empty for an absent one.
  std::vector<std::string> paths() const;

 private:
  CertificateCopies() = default;
  void FollowUntil(const std::stop_token& stop);

  std::vector<std::string> files_;
  Check check_;
  std::vector<int> copies_;         // open files, -1 for absent ones
  std::vector<std::string> state_;  // contents last looked at
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::jthread thread_;
};

}  // namespace rilievo
