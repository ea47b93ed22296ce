// The points of one call on their way in, and after them the triangles of a mesh or the file of a
// surface to bring up to date.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/conversion/call_error.h"
#include "server/conversion/scan_bytes.h"

namespace rilievo {

// Holds the bytes as they came, in memory or in a file: either grows with what arrived, never with
// what was announced.
class IncomingScan {
 public:
  // What the header announced: at least one point.
  explicit IncomingScan(const PayloadSize& size);
  // In a file of this folder, which is made when the first points come: who appends waits for the
  // disk.
  IncomingScan(const PayloadSize& size, std::string folder);

  // INVALID_ARGUMENT when `data` is empty, larger than kMaxChunkBytes, holds a broken record or
  // brings more than announced; or when anything comes before the last point, points after what
  // follows them, or what was not announced. RESOURCE_EXHAUSTED when the folder has no room,
  // UNAVAILABLE when it takes nothing for another reason.
  std::optional<CallError> AppendPoints(std::string&& data);
  std::optional<CallError> AppendTriangles(std::string&& data);
  std::optional<CallError> AppendBase(std::string&& data);

  // What the operator is told of the folder; OK where all was written.
  const absl::Status& written() const { return written_; }

  // DATA_LOSS when something is missing.
  std::optional<CallError> CheckComplete() const;

  int64_t bytes() const { return points_.bytes + triangles_.bytes + base_.bytes; }

  // All that came; nothing is left here.
  ScanBytes Take();

 private:
  // Records of one kind, as announced and as they came.
  struct Records {
    const char* name;  // of their message, and of several
    const char* one;
    const char* count_field;  // of the header
    int64_t record_bytes;
    int64_t announced;
    int64_t bytes = 0;

    int64_t count() const { return bytes / record_bytes; }
    std::optional<CallError> CheckChunk(int64_t size) const;
    std::optional<CallError> CheckComplete() const;
  };

  std::optional<CallError> Append(std::string&& data, Records* records);
  absl::Status AppendToFile(const std::string& data);
  // What comes after all points.
  std::optional<CallError> AppendBehind(std::string&& data, Records* records);

  Records points_, triangles_, base_;
  std::vector<std::string> blocks_;  // whole records each
  std::string folder_;               // of `file_`; empty: all is in memory
  FileDescriptor file_;
  absl::Status written_;
};

}  // namespace rilievo
