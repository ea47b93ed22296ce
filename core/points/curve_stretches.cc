#include "core/points/curve_stretches.h"

#include <algorithm>
#include <utility>

#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"
#include "core/points/morton_order.h"

namespace rilievo {
namespace {

class StretchCutter {
 public:
  static std::vector<int64_t> Ends(const std::vector<uint64_t>& codes, int64_t least) {
    const auto count = static_cast<int64_t>(codes.size());
    StretchCutter cutter(codes, least);
    if (!cutter.IsLarge(count)) return {count};
    cutter.CutCell(0, count, kMortonBits);
    return std::move(cutter.ends_);
  }

 private:
  StretchCutter(const std::vector<uint64_t>& codes, int64_t least) : codes_(codes), least_(least) {}

  bool IsLarge(int64_t points) const { return points > 2 * least_; }

  // Cuts the large cell that holds [begin, end), `height` levels above the finest. Points before it
  // that are in no stretch yet join its first stretch; they do not count towards its size.
  void CutCell(int64_t begin, int64_t end, int height) {
    const int shift = 3 * (height - 1);
    int64_t open = begin;
    for (int64_t from = begin; from < end;) {
      const uint64_t child = codes_[from] >> shift;
      const auto after =
          std::partition_point(codes_.begin() + from, codes_.begin() + end,
                               [&](uint64_t code) { return code >> shift == child; });
      const int64_t to = after - codes_.begin();
      if (IsLarge(to - from) && height > 1) {
        CutCell(from, to, height - 1);
        open = to;
      } else if (to - open >= least_) {
        ends_.push_back(to);
        open = to;
      }
      from = to;
    }
    ends_.back() = end;  // the last takes the few points after it
  }

  const std::vector<uint64_t>& codes_;
  const int64_t least_;
  std::vector<int64_t> ends_;
};

}  // namespace

absl::StatusOr<std::vector<uint64_t>> CodesAlong(const Eigen::Matrix3Xd& points,
                                                 const SpatialFrame& curve,
                                                 const RunContext& context) {
  std::vector<uint64_t> codes(static_cast<size_t>(points.cols()));
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(points.cols(), kLightBlock, context, [&](int64_t i) {
    const Eigen::Vector3d unit = curve.UnitFromScan(points.col(i));
    codes[i] = MortonCode(MortonCell(unit[0]), MortonCell(unit[1]), MortonCell(unit[2]));
  }));
  // Rounding in a change of frames may have moved a point across the face of a cell. One that leaps
  // ahead along the curve takes the code before it, one that falls back too.
  uint64_t last = 0;
  for (size_t i = 0; i < codes.size(); ++i) {
    const bool leaps = i + 1 < codes.size() && codes[i] > codes[i + 1] && codes[i + 1] >= last;
    if (leaps || codes[i] < last) codes[i] = last;
    last = codes[i];
  }
  return codes;
}

std::vector<int64_t> StretchEnds(const std::vector<uint64_t>& codes, int64_t least) {
  return StretchCutter::Ends(codes, least);
}

}  // namespace rilievo
