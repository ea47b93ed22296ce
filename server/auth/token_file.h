// The tokens of a file, as it is now.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "server/auth/access_tokens.h"

namespace rilievo {

// Adds a line to the file, which is made for its owner alone when it is not there. One write: a
// server reads the line whole or not at all.
absl::Status AddTokenLine(const std::string& path, const std::string& line);

// Thread-safe. One thread of its own looks at the file twice a second and reads a change once it
// has lasted from one look to the next; callers never wait for the disk. While the file cannot be
// read or holds an error, the tokens read last stay in force.
class TokenFile {
 public:
  // `complain`: told of each change that could not be read, on the file's own thread.
  // INVALID_ARGUMENT or NOT_FOUND, with the path, when it cannot be read now.
  static absl::StatusOr<std::unique_ptr<TokenFile>> Open(
      const std::string& path, std::function<void(const absl::Status&)> complain);

  std::optional<std::string> OwnerOf(absl::string_view token) const;

 private:
  // What changes with every writing of a file.
  struct Version {
    int64_t device = 0, inode = 0, bytes = 0, seconds = 0, nanoseconds = 0;
    bool operator==(const Version&) const = default;
  };

  TokenFile(std::string path, std::function<void(const absl::Status&)> complain)
      : path_(std::move(path)), complain_(std::move(complain)) {}

  Version CurrentVersion() const;
  absl::Status Read();
  void WatchUntil(const std::stop_token& stop);

  const std::string path_;
  const std::function<void(const absl::Status&)> complain_;
  mutable std::mutex mutex_;
  std::condition_variable_any wake_;
  std::shared_ptr<const AccessTokens> tokens_;
  Version version_;                    // that the tokens are from
  Version seen_;                       // last time
  std::optional<Version> complained_;  // the one that could not be read, once told
  std::jthread watcher_;
};

}  // namespace rilievo
