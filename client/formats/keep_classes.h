// The points of some classes alone.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "client/formats/scan_reader.h"

namespace rilievo {

// Drops all other points, and scan->classes. INVALID_ARGUMENT when not each point has a class, or
// none has one of these: the message names the classes that there are.
absl::Status KeepClasses(std::span<const uint8_t> classes, ScanFile* scan);

// Passes the points of some classes on as they are read.
class ClassSink : public PointSink {
 public:
  // `sink` must outlive it.
  ClassSink(std::span<const uint8_t> classes, PointSink* sink);

  absl::Status Expect(uint64_t points) override;
  void TakeClasses(std::span<const uint8_t> classes) override;
  void Take(const Eigen::Ref<const Eigen::Matrix3Xd>& points) override;

  // Of the scan whose points were taken: the errors of KeepClasses().
  absl::Status Finish(ScanFile* scan) const;

 private:
  std::array<bool, 256> wanted_{};
  PointSink& sink_;
  std::vector<uint8_t> classes_;  // of the points that come next
  std::array<int64_t, 256> counts_{};
  bool all_have_one_ = true;
};

}  // namespace rilievo
