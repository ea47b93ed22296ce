#include "core/surface/nearest_in_pages.h"

#include <algorithm>

#include "core/base/freed_memory.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr size_t kPagesKept = 16;

}  // namespace

absl::StatusOr<GatheredPoints> PointsWithin(const Eigen::AlignedBox3d& box, const PointPages& pages,
                                            const RunContext& context) {
  GatheredPoints gathered;
  std::vector<Eigen::Vector3d> points, normals;
  for (int page = 0; page < pages.count(); ++page) {
    if (!box.intersects(pages.Box(page))) continue;
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    RILIEVO_ASSIGN_OR_RETURN(const Shape all, pages.Read(page));
    const auto begin = static_cast<int64_t>(points.size());
    for (int i = 0; i < static_cast<int>(all.vertices.cols()); ++i) {
      if (!box.contains(all.vertices.col(i))) continue;
      points.emplace_back(all.vertices.col(i));
      if (all.normals.cols() > 0) normals.emplace_back(all.normals.col(i));
      gathered.shape.gaps.push_back(all.gaps[i]);
      gathered.places.push_back(i);
    }
    const auto end = static_cast<int64_t>(points.size());
    const auto all_of_page = static_cast<int>(all.vertices.cols());
    if (end > begin) gathered.pages.push_back({page, begin, end, all_of_page});
  }
  const auto columns = [](const std::vector<Eigen::Vector3d>& of) {
    return Eigen::Map<const Eigen::Matrix3Xd>(of.empty() ? nullptr : of.front().data(), 3,
                                              static_cast<Eigen::Index>(of.size()));
  };
  gathered.shape.vertices = columns(points);
  FreeMemoryOf(&points);
  gathered.shape.normals = columns(normals);
  return gathered;
}

absl::StatusOr<const Shape*> NearestInPages::Read(int page) {
  for (const auto& [number, points] : read_) {
    if (number == page) return &points;
  }
  RILIEVO_ASSIGN_OR_RETURN(Shape points, pages_.Read(page));
  if (read_.size() == kPagesKept) read_.pop_back();
  read_.emplace_front(page, std::move(points));
  return &read_.front().second;
}

absl::StatusOr<std::optional<NearestInPages::Found>> NearestInPages::Search(
    const Eigen::Vector3d& place, double least) {
  if (boxes_.empty()) {
    for (int page = 0; page < pages_.count(); ++page) boxes_.push_back(pages_.Box(page));
  }
  std::vector<std::pair<double, int>> nearest;
  for (int page = 0; page < pages_.count(); ++page) {
    const double away = boxes_[page].squaredExteriorDistance(place);
    if (away < least) nearest.emplace_back(away, page);
  }
  std::sort(nearest.begin(), nearest.end());
  std::optional<Found> found;
  for (const auto& [away, page] : nearest) {
    if (away >= least) break;
    RILIEVO_ASSIGN_OR_RETURN(const Shape* const points, Read(page));
    for (Eigen::Index i = 0; i < points->vertices.cols(); ++i) {
      const double squared = (points->vertices.col(i) - place).squaredNorm();
      if (squared >= least) continue;
      least = squared;
      found = Found{squared, points->vertices.col(i), points->gaps[i]};
    }
  }
  return found;
}

}  // namespace rilievo
