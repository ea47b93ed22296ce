#include "core/paging/scan_pager.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <functional>
#include <numeric>
#include <queue>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/freed_memory.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/crc32c.h"
#include "core/paging/cell_thinner.h"
#include "core/points/morton_order.h"
#include "core/scan/clean/check_scan.h"
#include "core/scan/clean/settings.h"

namespace rilievo {
namespace {

constexpr int64_t kBytesOfPoint = 3 * sizeof(double);
// Points that the limit of strays is found from, at most.
constexpr size_t kMostSampled = size_t{1} << 20;
constexpr int kMostHalvings = 40;
// Where the scratch folder is kept: what the thinned points tell besides.
constexpr int64_t kSavedBytesOfPoint = 64;
constexpr int64_t kMostSavedPoints = int64_t{1} << 22;
constexpr int64_t kBufferedPoints = 512;  // of each run, while they are merged

// Where a point stands on the curve; ties go by x, y, z (ComputeMortonOrder).
struct CurvePlace {
  uint64_t code = 0;
  Eigen::Vector3d point;

  bool operator>(const CurvePlace& other) const {
    if (code != other.code) return code > other.code;
    for (int axis = 0; axis < 3; ++axis) {
      if (point[axis] != other.point[axis]) return point[axis] > other.point[axis];
    }
    return false;
  }
};

CurvePlace PlaceOn(const SpatialFrame& curve, const Eigen::Vector3d& point) {
  const Eigen::Vector3d unit = curve.UnitFromScan(point);
  return {MortonCode(MortonCell(unit.x()), MortonCell(unit.y()), MortonCell(unit.z())), point};
}

// A sorted run on disk, read from its begin to its end.
class RunReader {
 public:
  RunReader(const ScratchFile& file, int64_t begin, int64_t count)
      : file_(&file), next_(begin), left_(count) {}

  // False at the end.
  absl::StatusOr<bool> Next(Eigen::Vector3d* point) {
    if (at_ == buffer_.cols()) {
      const int64_t count = std::min(kBufferedPoints, left_);
      if (count == 0) return false;
      buffer_.resize(3, count);
      RILIEVO_RETURN_IF_ERROR(file_->ReadAt(next_ * kBytesOfPoint, buffer_.data(),
                                            static_cast<size_t>(count * kBytesOfPoint)));
      next_ += count;
      left_ -= count;
      at_ = 0;
    }
    *point = buffer_.col(at_++);
    return true;
  }

 private:
  const ScratchFile* file_;
  int64_t next_, left_;
  Eigen::Matrix3Xd buffer_;
  Eigen::Index at_ = 0;
};

// All runs as one.
class RunMerger {
 public:
  RunMerger(const ScratchFile& file, const std::vector<int64_t>& counts, int64_t run_points,
            const SpatialFrame& curve)
      : curve_(curve) {
    for (size_t run = 0; run < counts.size(); ++run) {
      readers_.emplace_back(file, static_cast<int64_t>(run) * run_points, counts[run]);
    }
  }

  absl::Status Start() {
    for (size_t run = 0; run < readers_.size(); ++run) RILIEVO_RETURN_IF_ERROR(Refill(run));
    return absl::OkStatus();
  }
  bool done() const { return heads_.empty(); }
  absl::StatusOr<CurvePlace> Take() {
    const Head head = heads_.top();
    heads_.pop();
    RILIEVO_RETURN_IF_ERROR(Refill(head.run));
    return head.place;
  }

 private:
  struct Head {
    CurvePlace place;
    size_t run;
    bool operator>(const Head& other) const { return place > other.place; }
  };

  absl::Status Refill(size_t run) {
    Eigen::Vector3d point;
    RILIEVO_ASSIGN_OR_RETURN(const bool found, readers_[run].Next(&point));
    if (found) heads_.push({PlaceOn(curve_, point), run});
    return absl::OkStatus();
  }

  const SpatialFrame& curve_;
  std::vector<RunReader> readers_;
  std::priority_queue<Head, std::vector<Head>, std::greater<>> heads_;
};

// Points in the order of the curve, into pages.
class PageWriter {
 public:
  explicit PageWriter(ScratchFile file)
      : file_(std::move(file)), points_(3, kPagePoints), codes_(kPagePoints) {}

  absl::Status Add(const CurvePlace& place) {
    // The levels at whose cells this point begins another one: all, or from the first bit on in
    // which the codes differ.
    const int first = size_ == 0 ? 0 : FirstLevelApart(place.code, last_code_);
    if (first <= kMortonBits) ++new_cells_[first];
    last_code_ = place.code;
    codes_[static_cast<size_t>(count_)] = place.code;
    points_.col(count_++) = place.point;
    ++size_;
    return count_ == kPagePoints ? Flush() : absl::OkStatus();
  }

  absl::StatusOr<PagedScan> Finish(const SpatialFrame& curve, const PagingFigures& figures) {
    if (count_ > 0) RILIEVO_RETURN_IF_ERROR(Flush());
    CellCounts cells{};
    int64_t sum = 0;
    for (size_t level = 0; level < cells.size(); ++level) cells[level] = sum += new_cells_[level];
    return PagedScan(std::move(file_), std::move(pages_), size_, curve, cells, figures);
  }

  int64_t size() const { return size_; }

 private:
  absl::Status Flush() {
    const auto points = points_.leftCols(count_);
    const auto bytes = static_cast<size_t>(count_ * kBytesOfPoint);
    RILIEVO_RETURN_IF_ERROR(file_.Append(points_.data(), bytes));
    pages_.push_back({Eigen::AlignedBox3d(points.rowwise().minCoeff(), points.rowwise().maxCoeff()),
                      CutStretches(points, std::span(codes_).first(static_cast<size_t>(count_))),
                      Crc32c(std::span(reinterpret_cast<const uint8_t*>(points_.data()), bytes))});
    count_ = 0;
    return absl::OkStatus();
  }

  ScratchFile file_;
  Eigen::Matrix3Xd points_;
  std::vector<uint64_t> codes_;
  Eigen::Index count_ = 0;  // of both
  std::vector<Page> pages_;
  int64_t size_ = 0;
  uint64_t last_code_ = 0;
  CellCounts new_cells_{};
};

}  // namespace

absl::StatusOr<ScanPager> ScanPager::Create(ScratchFolder folder, int64_t run_points) {
  RILIEVO_ASSIGN_OR_RETURN(ScratchFile raw, ScratchFile::Create(folder.WithoutNames(), ""));
  return ScanPager(std::move(folder), run_points, std::move(raw));
}

// Those whose coordinates, as bits, fall among the first of 2^`halvings_`: the same whatever the
// order they come in.
void ScanPager::Sample(const Eigen::Vector3d& point) {
  const auto is_taken = [this](const Eigen::Vector3d& p) {
    uint64_t mixed = 0x243f6a8885a308d3u;  // no round coordinates give 0
    for (const double coordinate : p) {
      mixed = (mixed ^ std::bit_cast<uint64_t>(coordinate)) * 0x9e3779b97f4a7c15u;
      mixed ^= mixed >> 32;
    }
    return (mixed & ((uint64_t{1} << halvings_) - 1)) == 0;
  };
  if (!is_taken(point)) return;
  sample_.push_back(point);
  while (sample_.size() >= kMostSampled && halvings_ < kMostHalvings) {
    ++halvings_;
    std::erase_if(sample_, [&](const Eigen::Vector3d& p) { return !is_taken(p); });
  }
}

absl::Status ScanPager::Add(const Eigen::Ref<const Eigen::Matrix3Xd>& points) {
  figures_.points_in += points.cols();
  Eigen::Matrix3Xd finite(3, points.cols());
  Eigen::Index count = 0;
  for (const auto point : points.colwise()) {
    if (!point.allFinite()) {
      ++figures_.non_finite;
      continue;
    }
    finite.col(count++) = point;
    box_.extend(point);
    Sample(point);
    ++finite_;
  }
  return raw_.Append(finite.data(), static_cast<size_t>(count * kBytesOfPoint));
}

absl::Status ScanPager::Expect(int64_t points) {
  expected_ += points;
  int64_t needed = kScratchBytesOfPoint * expected_;
  if (folder_.keeps()) needed += kSavedBytesOfPoint * std::min(expected_, kMostSavedPoints);
  return CheckRoom(folder_, needed - raw_.size());
}

absl::Status ScanPager::TooFew(int64_t distinct) const {
  return absl::InvalidArgumentError(
      absl::StrCat("points: ", distinct, " distinct finite points (dropped: ", figures_.non_finite,
                   " non-finite, ", figures_.duplicates, " duplicates, ", figures_.strays,
                   " strays), at least ", kCheckScan.min_scan_points, " are needed"));
}

absl::StatusOr<Eigen::Matrix3Xd> ScanPager::ReadRun(int64_t begin) const {
  Eigen::Matrix3Xd points(3, std::min(run_points_, finite_ - begin));
  RILIEVO_RETURN_IF_ERROR(raw_.ReadAt(begin * kBytesOfPoint, points.data(),
                                      static_cast<size_t>(points.cols() * kBytesOfPoint)));
  return points;
}

absl::StatusOr<SpatialFrame> ScanPager::FrameOf(const RunContext& context) {
  if (finite_ == 0 || box_.isEmpty() || box_.min() == box_.max())
    return TooFew(finite_ > 0 ? 1 : 0);
  if (sample_.empty()) sample_ = {box_.min(), box_.max()};  // nearly all were at one place
  const Eigen::Map<const Eigen::Matrix3Xd> sampled(sample_.front().data(), 3,
                                                   static_cast<Eigen::Index>(sample_.size()));
  std::vector<int> columns(sample_.size());
  std::iota(columns.begin(), columns.end(), 0);
  RILIEVO_ASSIGN_OR_RETURN(const Eigen::AlignedBox3d limit, StrayLimit(sampled, columns, context));
  FreeMemoryOf(&sample_);
  if (!limit.contains(box_)) {
    limit_ = limit;
    box_.setEmpty();
    for (int64_t begin = 0; begin < finite_; begin += run_points_) {
      RILIEVO_RETURN_IF_ERROR(context.CheckStop());
      RILIEVO_ASSIGN_OR_RETURN(const Eigen::Matrix3Xd points, ReadRun(begin));
      for (const auto point : points.colwise()) {
        if (limit.contains(point)) box_.extend(point);
      }
    }
  }
  Eigen::Matrix3Xd corners(3, 2);
  corners << box_.min(), box_.max();
  return BoundingFrame(corners, {0, 1});
}

// How many points are left in each run.
absl::StatusOr<std::vector<int64_t>> ScanPager::SortRuns(const SpatialFrame& frame,
                                                         const RunContext& context) {
  std::vector<int64_t> counts;
  for (int64_t begin = 0; begin < finite_; begin += run_points_) {
    RILIEVO_ASSIGN_OR_RETURN(Eigen::Matrix3Xd points, ReadRun(begin));
    Eigen::Index kept = 0;
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      if (limit_ && !limit_->contains(points.col(i))) continue;
      points.col(kept++) = points.col(i);
    }
    figures_.strays += points.cols() - kept;
    points.conservativeResize(3, kept);
    Eigen::Matrix3Xd unit(3, kept);
    for (Eigen::Index i = 0; i < kept; ++i) unit.col(i) = frame.UnitFromScan(points.col(i));
    RILIEVO_ASSIGN_OR_RETURN(const MortonOrder morton, ComputeMortonOrder(unit, context));
    for (Eigen::Index i = 0; i < kept; ++i) unit.col(i) = points.col(morton.order[i]);
    RILIEVO_RETURN_IF_ERROR(raw_.WriteAt(begin * kBytesOfPoint, unit.data(),
                                         static_cast<size_t>(kept * kBytesOfPoint)));
    counts.push_back(kept);
    context.Report(Stage::kCheck,
                   0.5 * static_cast<double>(begin + run_points_) / static_cast<double>(finite_));
  }
  return counts;
}

absl::StatusOr<PagedScan> ScanPager::Finish(const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(Expect(std::max<int64_t>(0, finite_ - expected_)));
  RILIEVO_ASSIGN_OR_RETURN(const SpatialFrame frame, FrameOf(context));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<int64_t> counts, SortRuns(frame, context));
  RILIEVO_ASSIGN_OR_RETURN(ScratchFile file, ScratchFile::Create(folder_, "pages"));
  RILIEVO_RETURN_IF_ERROR(file.Resize(0));
  PageWriter writer(std::move(file));
  RunMerger merger(raw_, counts, run_points_, frame);
  RILIEVO_RETURN_IF_ERROR(merger.Start());
  std::optional<Eigen::Vector3d> last;
  for (int64_t taken = 0; !merger.done(); ++taken) {
    if (taken % kHeavyBlock == 0) RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    RILIEVO_ASSIGN_OR_RETURN(const CurvePlace place, merger.Take());
    if (last == place.point) {
      ++figures_.duplicates;
      continue;
    }
    last = place.point;
    RILIEVO_RETURN_IF_ERROR(writer.Add(place));
  }
  if (writer.size() < kCheckScan.min_scan_points) return TooFew(writer.size());
  context.Report(Stage::kCheck, 1);
  // Frees its room on the disk, though a server may keep the file open.
  RILIEVO_RETURN_IF_ERROR(raw_.Resize(0));
  RILIEVO_ASSIGN_OR_RETURN(PagedScan scan, writer.Finish(frame, figures_));
  RILIEVO_RETURN_IF_ERROR(scan.Save());
  return scan;
}

}  // namespace rilievo
