// Any bytes as a scan: all of it with all that it tells, and chosen points of it.
#pragma once

#include <cstdint>
#include <sstream>
#include <string>

#include "absl/status/statusor.h"
#include "client/formats/scan_reader.h"
#include "tests/fuzz/require.h"

namespace rilievo {

// Has enough after some blocks.
class FewBlocks : public PointSink {
 public:
  absl::Status Expect(uint64_t /*points*/) override { return absl::OkStatus(); }
  absl::Status Take(const Eigen::Ref<const Eigen::Matrix3Xd>& points) override {
    count_ += points.cols();
    return count_ > kEnough ? absl::AbortedError("enough") : absl::OkStatus();
  }
  int64_t count() const { return count_; }

 private:
  static constexpr int64_t kEnough = 1 << 16;
  int64_t count_ = 0;
};

inline void RequireScan(const absl::StatusOr<ScanFile>& scan) {
  if (!scan.ok()) {
    Require(!scan.status().message().empty());
    return;
  }
  Require(CheckSights(scan->cloud.sights, scan->cloud.points.cols()).ok());
  const size_t intensities = scan->layers.intensity.size();
  Require(intensities == 0 || intensities == static_cast<size_t>(scan->cloud.points.cols()));
  Require(!scan->format.empty());
}

// `read`: from a stream what is wanted. `most`: points that so many bytes can hold.
template <typename Read>
void ReadScanInFull(const std::string& bytes, int64_t most, const Read& read) {
  WantedLayers wanted = {.intensity = true, .colors = true, .stations = true, .normals = true};
  std::istringstream in(bytes);
  const absl::StatusOr<ScanFile> scan = read(in, wanted);
  RequireScan(scan);
  const int64_t all = scan.ok() ? scan->cloud.points.cols() : most;
  Require(all <= most);
  // Half of the inputs give chosen points with all that is known of them, half give them to a sink.
  FewBlocks sink;
  const bool to_sink = !bytes.empty() && (bytes[bytes.size() / 2] & 1) != 0;
  if (to_sink) wanted = {.sink = &sink};
  wanted.classes = {2, 6};
  wanted.last_returns = true;
  std::istringstream again(bytes);
  const absl::StatusOr<ScanFile> chosen = read(again, wanted);
  RequireScan(chosen);
  if (!chosen.ok()) return;
  Require((to_sink ? sink.count() : chosen->cloud.points.cols()) <= all);
}

}  // namespace rilievo
