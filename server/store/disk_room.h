// Room on the disk that is kept back for deletions.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>

#include "absl/status/status.h"

namespace rilievo {

// A file that takes room until a deletion needs it. Thread-safe.
class DiskRoom {
 public:
  // In `folder`: 4 MB, less on a small disk.
  explicit DiskRoom(const std::string& folder);

  // No write found room since the latest one that did, and there is none yet.
  bool full() const { return full_; }

  // Before a write: RESOURCE_EXHAUSTED while there is no room for the file.
  absl::Status Check();

  // After one: keeps in mind that it found no room.
  void Note(const absl::Status& written);

  // Gives the room to who frees more.
  void Release();

 private:
  absl::Status Reserve();

  const std::string path_;
  const int64_t bytes_;
  std::mutex mutex_;
  std::atomic<bool> full_{false};
};

}  // namespace rilievo
