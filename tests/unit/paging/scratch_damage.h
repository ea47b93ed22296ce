// Harm to the files of a scratch folder, which have no name.
#pragma once

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <string>

namespace rilievo {

// Turns a bit of the byte at `offset` of the one scratch file that this process has open; false
// where there are none or several.
inline bool DamageScratchFile(int64_t offset) {
  std::string found;
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    struct stat status;
    if (stat(entry.path().c_str(), &status) != 0 || !S_ISREG(status.st_mode)) continue;
    if (status.st_nlink > 0) continue;
    found = entry.path().string();
    ++count;
  }
  if (count != 1) return false;
  const int file = open(found.c_str(), O_RDWR | O_CLOEXEC);
  uint8_t byte = 0;
  const bool done = file >= 0 && pread(file, &byte, 1, offset) == 1 &&
                    (byte ^= 1, pwrite(file, &byte, 1, offset) == 1);
  if (file >= 0) close(file);
  return done;
}

}  // namespace rilievo
