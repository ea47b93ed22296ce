// Files on their way into a ZIP archive (PKWARE APPNOTE 6.3.3), deflated as they come.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"

namespace rilievo {

class ZipStream {
 public:
  explicit ZipStream(std::ostream& out);
  ~ZipStream();
  ZipStream(const ZipStream&) = delete;
  ZipStream& operator=(const ZipStream&) = delete;

  // Begins a file, and ends the one before it.
  void Begin(const std::string& name);
  // Bytes of the file that was begun last.
  void Append(std::string_view bytes);
  // Ends the last file and the archive. INVALID_ARGUMENT where a file or the archive has more than
  // the 4 GiB that the format holds without its 64-bit extension.
  absl::Status Finish();

 private:
  struct Entry {
    std::string name;
    uint32_t checksum = 0;
    uint64_t offset = 0, packed = 0, unpacked = 0;
  };

  void Write(std::string_view bytes);
  void Deflate(std::string_view bytes, int flush);
  void End();

  std::ostream& out_;
  z_stream deflate_ = {};
  std::vector<char> block_;
  std::vector<Entry> entries_;
  uint64_t written_ = 0;
  bool is_open_ = false;
};

}  // namespace rilievo
