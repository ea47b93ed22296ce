#include "core/paging/paged_scan.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/crc32c.h"
#include "core/codec/bytes/saved_value.h"
#include "core/paging/cell_thinner.h"

namespace rilievo {
namespace {

constexpr int64_t kPointBytes = 3 * sizeof(double);

// Of the points that may be chosen, one in so many cells of the coarsest level at most; these are
// cut so often at most.
constexpr int64_t kShareOfCoarsest = 4;
constexpr int kMostCuts = 5;

constexpr char kPagesName[] = "pages", kIndexName[] = "pages.index";

struct PageIndex {
  int64_t size = 0;
  SpatialFrame curve;
  CellCounts cells{};
  PagingFigures figures;
  std::vector<uint32_t> checksums;  // of each page
  std::vector<int32_t> stretches;   // how many each page has
  // Of each stretch: its points, and its box.
  std::vector<int32_t> points;
  Eigen::Matrix3Xd low, high;
};

template <typename Archive, typename Index>
void VisitIndex(Archive& archive, Index& index) {
  archive(index.size);
  archive(index.curve.center);
  archive(index.curve.diagonal);
  archive(index.cells);
  archive(index.figures);
  archive(index.checksums);
  archive(index.stretches);
  archive(index.points);
  archive(index.low);
  archive(index.high);
}

absl::Status WrongCells(const ScratchFolder& folder) {
  return absl::DataLossError(absl::StrCat("scratch folder ", folder.path(),
                                          ": the index of the scan is not that of its points; "
                                          "remove the folder"));
}

// Whether so many points can have them.
bool AreCells(const CellCounts& cells, int64_t points) {
  return cells.front() >= 1 && cells.back() <= points && std::is_sorted(cells.begin(), cells.end());
}

// Unset where they do not fit together.
std::optional<std::vector<Page>> PagesOf(const PageIndex& index) {
  const auto columns = static_cast<Eigen::Index>(index.points.size());
  const auto pages = static_cast<int64_t>(index.checksums.size());
  if (index.stretches.size() != index.checksums.size() || index.low.cols() != columns ||
      index.high.cols() != columns || pages != (index.size + kPagePoints - 1) / kPagePoints) {
    return std::nullopt;
  }
  std::vector<Page> found;
  Eigen::Index column = 0;
  for (int page = 0; page < static_cast<int>(pages); ++page) {
    Page next;
    next.checksum = index.checksums[page];
    int64_t points = 0;
    if (index.stretches[page] > columns - column) return std::nullopt;
    for (int i = 0; i < index.stretches[page]; ++i, ++column) {
      next.stretches.push_back({{index.low.col(column), index.high.col(column)},
                                index.points[static_cast<size_t>(column)]});
      next.box.extend(next.stretches.back().box);
      points += next.stretches.back().points;
    }
    if (points != PointsOfPage(page, index.size)) return std::nullopt;
    found.push_back(std::move(next));
  }
  return column == columns ? std::optional(std::move(found)) : std::nullopt;
}

}  // namespace

int64_t Page::PointsNear(const Eigen::AlignedBox3d& within) const {
  if (!within.intersects(box)) return 0;
  int64_t points = 0;
  for (const PageStretch& stretch : stretches) {
    if (within.intersects(stretch.box)) points += stretch.points;
  }
  return points;
}

absl::StatusOr<Eigen::Matrix3Xd> PagedScan::Read(int page) const {
  Eigen::Matrix3Xd points(3, PointsOfPage(page, size_));
  const auto bytes = static_cast<size_t>(points.cols() * kPointBytes);
  RILIEVO_RETURN_IF_ERROR(
      file_.ReadAt(int64_t{page} * kPagePoints * kPointBytes, points.data(), bytes));
  const auto* const data = reinterpret_cast<const uint8_t*>(points.data());
  if (Crc32c(std::span(data, bytes)) != pages_[page].checksum) {
    return absl::DataLossError(
        absl::StrCat("page ", page, " of ", pages_.size(),
                     " of the scan is damaged on the scratch disk; run the command again"));
  }
  return points;
}

absl::StatusOr<Eigen::Matrix3Xd> PagedScan::PointsIn(const Eigen::AlignedBox3d& box,
                                                     const RunContext& context,
                                                     std::vector<int64_t>* ranks) const {
  if (ranks != nullptr) ranks->clear();
  std::vector<Eigen::Vector3d> within;
  for (int page = 0; page < static_cast<int>(pages_.size()); ++page) {
    if (pages_[page].PointsNear(box) == 0) continue;
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    RILIEVO_ASSIGN_OR_RETURN(const Eigen::Matrix3Xd points, Read(page));
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      if (!box.contains(points.col(i))) continue;
      within.emplace_back(points.col(i));
      if (ranks != nullptr) ranks->push_back(int64_t{page} * kPagePoints + i);
    }
  }
  return Eigen::Map<const Eigen::Matrix3Xd>(within.empty() ? nullptr : within.front().data(), 3,
                                            static_cast<Eigen::Index>(within.size()));
}

int PagedScan::LevelOf(int64_t most) const {
  int level = kMortonBits;
  while (level > 0 && cells_[level] > most) --level;
  return level;
}

absl::StatusOr<Eigen::Matrix3Xd> PagedScan::All(const RunContext& context) const {
  Eigen::Matrix3Xd whole(3, size_);
  for (int page = 0; page < static_cast<int>(pages_.size()); ++page) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    RILIEVO_ASSIGN_OR_RETURN(const Eigen::Matrix3Xd points, Read(page));
    whole.middleCols(int64_t{page} * kPagePoints, points.cols()) = points;
  }
  return whole;
}

absl::StatusOr<Eigen::Matrix3Xd> PagedScan::Thinned(int64_t most, const std::vector<bool>& left_out,
                                                    const RunContext& context) const {
  if (size_ <= most) return All(context);
  const int coarsest = LevelOf(std::max<int64_t>(1, most / kShareOfCoarsest));
  const int deepest = std::min(kMortonBits, coarsest + kMostCuts);
  const auto thin = [&](CellDetail limit) -> absl::StatusOr<CellThinner> {
    CellThinner thinner(curve_, coarsest, deepest, limit);
    for (int page = 0; page < static_cast<int>(pages_.size()); ++page) {
      RILIEVO_RETURN_IF_ERROR(context.CheckStop());
      RILIEVO_ASSIGN_OR_RETURN(const Eigen::Matrix3Xd points, Read(page));
      for (Eigen::Index i = 0; i < points.cols(); ++i) {
        const auto place = static_cast<size_t>(int64_t{page} * kPagePoints + i);
        if (left_out.empty() || !left_out[place]) thinner.Add(points.col(i));
      }
    }
    return thinner;
  };
  RILIEVO_ASSIGN_OR_RETURN(CellThinner survey, thin(CellThinner::kMostDetail));
  survey.Finish();
  RILIEVO_ASSIGN_OR_RETURN(CellThinner thinner, thin(survey.LimitFor(most)));
  Eigen::Matrix3Xd chosen = thinner.Finish();
  if (chosen.cols() > most) return WrongCells(scratch_folder());
  return chosen;
}

absl::StatusOr<Eigen::Matrix3Xd> PagedScan::Sampled(int64_t most, const std::vector<bool>& left_out,
                                                    const RunContext& context) const {
  const int64_t kept = size_ - std::count(left_out.begin(), left_out.end(), true);
  most = std::min(most, kept);
  Eigen::Matrix3Xd chosen(3, most);
  int64_t seen = 0, next = 0;
  for (int page = 0; page < static_cast<int>(pages_.size()); ++page) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    RILIEVO_ASSIGN_OR_RETURN(const Eigen::Matrix3Xd points, Read(page));
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      const auto place = static_cast<size_t>(int64_t{page} * kPagePoints + i);
      if (!left_out.empty() && left_out[place]) continue;
      if (seen++ * most / kept == next) chosen.col(next++) = points.col(i);
    }
  }
  return chosen;
}

absl::Status PagedScan::Save() const {
  PageIndex index{size_, curve_, cells_, figures_, {}, {}, {}, {}, {}};
  for (const Page& page : pages_) {
    index.checksums.push_back(page.checksum);
    index.stretches.push_back(static_cast<int32_t>(page.stretches.size()));
    for (const PageStretch& stretch : page.stretches) index.points.push_back(stretch.points);
  }
  index.low.resize(3, static_cast<Eigen::Index>(index.points.size()));
  index.high.resize(3, index.low.cols());
  Eigen::Index column = 0;
  for (const Page& page : pages_) {
    for (const PageStretch& stretch : page.stretches) {
      index.low.col(column) = stretch.box.min();
      index.high.col(column++) = stretch.box.max();
    }
  }
  ValueWriter writer;
  VisitIndex(writer, index);
  return file_.folder().Save(kIndexName, writer.bytes);
}

absl::StatusOr<std::optional<PagedScan>> FindPagedScan(const ScratchFolder& folder,
                                                       const RunContext& context) {
  const std::optional<std::vector<uint8_t>> saved = folder.Load(kIndexName);
  if (!saved) return std::nullopt;
  PageIndex index;
  ValueReader reader(*saved);
  VisitIndex(reader, index);
  absl::StatusOr<ScratchFile> file = ScratchFile::Create(folder, kPagesName);
  if (!reader.Finished() || !AreCells(index.cells, index.size) || !file.ok() ||
      file->size() != index.size * kPointBytes) {
    return std::nullopt;
  }
  std::optional<std::vector<Page>> pages = PagesOf(index);
  if (!pages) return std::nullopt;
  const auto count = static_cast<int>(pages->size());
  PagedScan scan(*std::move(file), *std::move(pages), index.size, index.curve, index.cells,
                 index.figures);
  for (int page = 0; page < count; ++page) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    const absl::StatusOr<Eigen::Matrix3Xd> points = scan.Read(page);
    if (!points.ok() || !points->allFinite()) return std::nullopt;
  }
  return scan;
}

}  // namespace rilievo
