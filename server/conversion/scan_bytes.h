// The points of a scan as they came, and after them the triangles of a mesh or the file of a
// surface to bring up to date: between the wire or the disk and the work.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/geometry/point_records.h"
#include "server/os/file_descriptor.h"

namespace rilievo {

// What a header announces.
struct PayloadSize {
  PointLayout layout;
  int64_t points = 0;
  int64_t triangles = 0;   // 0: a scan, else a mesh whose vertices are the points
  int64_t base_bytes = 0;  // of the .dss file of a surface to bring up to date; 0: none

  int64_t bytes() const { return BytesOfRecords(layout, points, triangles) + base_bytes; }
};

struct ScanContents {
  PointCloud scan;            // or mesh
  std::vector<uint8_t> base;  // .dss
};

// Records (core/geometry/point_records.h), and a file behind them, in memory or in a file.
class ScanBytes {
 public:
  // `blocks`: whole records each, or parts of the file behind them.
  explicit ScanBytes(std::vector<std::string> blocks) : blocks_(std::move(blocks)) {}
  // `file`: all of it, wherever its offset stands. `sha256`: what it is to have, hexadecimal;
  // empty: not known.
  explicit ScanBytes(FileDescriptor file, std::string sha256 = {})
      : file_(std::move(file)), sha256_(std::move(sha256)) {}

  // All points, without a table of stations, all triangles, whose corners are as they came, and the
  // file behind them; memory and file are given back to the system on the way. DATA_LOSS when there
  // are more or fewer bytes than so many points and triangles take, or when the file has another
  // SHA-256; INTERNAL when it cannot be read.
  absl::StatusOr<ScanContents> Decode(const PayloadSize& size) &&;

  // The places of all points, some at a time and in order. `size`: of a scan alone. The errors of
  // Decode(), before or after all points were taken, and that of `take`.
  absl::Status DecodeInBlocks(
      const PayloadSize& size,
      const std::function<absl::Status(const Eigen::Matrix3Xd& points)>& take) &&;

  const std::string& sha256() const { return sha256_; }

  // For another process: the file, or an unnamed one in memory. RESOURCE_EXHAUSTED when there is no
  // room for it. The bytes begin at offset 0.
  absl::StatusOr<FileDescriptor> TakeFile() &&;

 private:
  absl::Status CheckSize(const PayloadSize& size) const;

  std::vector<std::string> blocks_;
  FileDescriptor file_;
  std::string sha256_;
};

}  // namespace rilievo
