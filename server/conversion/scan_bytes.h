// The points of a scan, and of a mesh its triangles after them, as they came: between the wire or
// the disk and the work.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/geometry/point_records.h"
#include "server/os/file_descriptor.h"

namespace rilievo {

// Records (core/geometry/point_records.h) in memory or in a file.
class ScanBytes {
 public:
  // `blocks`: whole records each.
  explicit ScanBytes(std::vector<std::string> blocks) : blocks_(std::move(blocks)) {}
  // `file`: all of it, wherever its offset stands. `sha256`: what it is to have, hexadecimal;
  // empty: not known.
  explicit ScanBytes(FileDescriptor file, std::string sha256 = {})
      : file_(std::move(file)), sha256_(std::move(sha256)) {}

  // All points, without a table of stations, and all triangles, whose corners are as they came;
  // memory and file are given back to the system on the way. `triangle_count`: 0 of a scan.
  // DATA_LOSS when there are more or fewer bytes than so many points and triangles take, or when
  // the file has another SHA-256; INTERNAL when it cannot be read.
  absl::StatusOr<PointCloud> Decode(const PointLayout& layout, int64_t point_count,
                                    int64_t triangle_count) &&;

  const std::string& sha256() const { return sha256_; }

  // For another process: the file, or an unnamed one in memory. RESOURCE_EXHAUSTED when there is no
  // room for it. The bytes begin at offset 0.
  absl::StatusOr<FileDescriptor> TakeFile() &&;

 private:
  std::vector<std::string> blocks_;
  FileDescriptor file_;
  std::string sha256_;
};

}  // namespace rilievo
