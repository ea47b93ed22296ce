// The points of one call on their way in.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/conversion/call_error.h"
#include "server/conversion/job_request.h"
#include "server/conversion/scan_bytes.h"

namespace rilievo {

// Holds the bytes as they came: memory grows with what arrived, never with what was announced.
class PointUpload {
 public:
  // `point_count`: as announced, >= 1.
  PointUpload(int64_t point_count, const PointLayout& layout);

  // INVALID_ARGUMENT when `data` is empty, larger than kMaxChunkBytes, holds a broken point, or
  // brings more points than announced.
  std::optional<CallError> Append(std::string&& data);

  // DATA_LOSS when points are missing.
  std::optional<CallError> CheckComplete() const;

  int64_t bytes() const { return bytes_; }

  // All that came; nothing is left here.
  ScanBytes TakePoints();

 private:
  int64_t point_count_;
  PointLayout layout_;
  int64_t bytes_ = 0;
  std::vector<std::string> blocks_;  // whole points each
};

}  // namespace rilievo
