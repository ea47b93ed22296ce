#include "client/cli/parts_choice.h"

#include <sys/stat.h>

#include <algorithm>
#include <limits>
#include <variant>

#include "client/cli/working_server.h"
#include "core/base/status_macros.h"
#include "server/conversion/call_error.h"
#include "server/conversion/job_request.h"
#include "server/conversion/memory_estimate.h"
#include "server/os/memory_limit.h"

namespace rilievo {
namespace {

// Of a point in any format, compressed or not, at least.
constexpr int64_t kLeastBytesOfPoint = 1;
constexpr int64_t kMostPoints = std::numeric_limits<int32_t>::max();

// With the points themselves.
absl::StatusOr<int64_t> MemoryFor(int64_t points, const v1::ReconstructOptions& options) {
  constexpr int64_t kPointBytes = 3 * sizeof(double);
  constexpr int64_t kFewest = 20;
  v1::ReconstructHeader header;
  header.set_point_count(static_cast<uint64_t>(std::clamp(points, kFewest, kMostPoints)));
  header.set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT64_LE);
  *header.mutable_options() = options;
  const auto parsed = ParseHeader(header, LimitsForOneself());
  if (const auto* error = std::get_if<CallError>(&parsed)) return StatusOf(*error);
  return EstimateMemory(std::get<JobRequest>(parsed)) + kPointBytes * points;
}

// Counts points, and ends the reading once they are more than enough.
class EnoughPoints : public PointSink {
 public:
  EnoughPoints(int64_t enough, const std::stop_token& stop) : enough_(enough), stop_(stop) {}

  absl::Status Expect(uint64_t points) override {
    expected_ += static_cast<int64_t>(std::min<uint64_t>(points, uint64_t{kMostPoints}));
    return Enough();
  }
  absl::Status Take(const Eigen::Ref<const Eigen::Matrix3Xd>& points) override {
    taken_ += points.cols();
    return Enough();
  }
  int64_t count() const { return std::max(expected_, taken_); }

 private:
  absl::Status Enough() const {
    if (stop_.stop_requested()) return absl::CancelledError("cancelled");
    return count() > enough_ ? absl::AbortedError("enough") : absl::OkStatus();
  }

  int64_t enough_;
  std::stop_token stop_;
  int64_t expected_ = 0, taken_ = 0;
};

// The most points that take no more than `limit`.
absl::StatusOr<int64_t> PointsWithin(int64_t limit, const v1::ReconstructOptions& options) {
  int64_t fits = 0, too_many = kMostPoints;
  while (too_many - fits > 1) {
    const int64_t middle = fits + (too_many - fits) / 2;
    RILIEVO_ASSIGN_OR_RETURN(const int64_t memory, MemoryFor(middle, options));
    (memory <= limit ? fits : too_many) = middle;
  }
  return fits;
}

}  // namespace

absl::StatusOr<ScanSize> SizeOfScan(const std::string& path, const ScanArguments& arguments,
                                    const ReconstructArguments& options, int64_t memory,
                                    const std::stop_token& stop) {
  ScanSize size;
  size.limit = memory > 0 ? memory : MemoryForThisProcess() / 10 * 8;
  struct stat file;
  if (path == "-" || stat(path.c_str(), &file) != 0) return size;
  RILIEVO_ASSIGN_OR_RETURN(const v1::ReconstructOptions asked, OptionsFrom(options));
  RILIEVO_ASSIGN_OR_RETURN(const int64_t most, PointsWithin(size.limit, asked));
  if (file.st_size / kLeastBytesOfPoint <= most) return size;
  EnoughPoints sink(most, stop);
  WantedLayers wanted;
  wanted.sink = &sink;
  const absl::Status read = LoadScan(path, arguments, wanted).status();
  size.points = sink.count();
  if (!read.ok() && size.points <= most) return read;
  RILIEVO_ASSIGN_OR_RETURN(size.memory, MemoryFor(size.points, asked));
  return size;
}

}  // namespace rilievo
