#include "core/control/planar/occupied_area.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/serial_for.h"
#include "core/base/status_macros.h"
#include "core/control/planar/plane_frame.h"
#include "core/control/planar/settings.h"
#include "core/points/settings.h"

namespace rilievo {
namespace {

using Eigen::Vector2d;

// Squared distances to the nearest source along one line, as the lower envelope of parabolas
// (Felzenszwalb and Huttenlocher 2012). `value` in and out; `stride` between its samples.
class LineTransform {
 public:
  void Run(float* value, int count, int stride) {
    line_.resize(static_cast<size_t>(count));
    place_.resize(static_cast<size_t>(count));
    start_.resize(static_cast<size_t>(count) + 1);
    for (int i = 0; i < count; ++i) line_[i] = value[static_cast<size_t>(i) * stride];
    int last = -1;
    for (int q = 0; q < count; ++q) {
      if (line_[q] >= kFar) continue;
      double cross = -std::numeric_limits<double>::infinity();
      while (last >= 0 && (cross = Crossing(place_[last], q)) <= start_[last]) --last;
      if (last < 0) cross = -std::numeric_limits<double>::infinity();
      ++last;
      place_[last] = q;
      start_[last] = cross;
    }
    if (last < 0) return;
    start_[last + 1] = std::numeric_limits<double>::infinity();
    for (int i = 0, k = 0; i < count; ++i) {
      while (start_[k + 1] < i) ++k;
      const double step = i - place_[k];
      value[static_cast<size_t>(i) * stride] = static_cast<float>(step * step + line_[place_[k]]);
    }
  }

  static constexpr float kFar = std::numeric_limits<float>::infinity();

 private:
  double Crossing(int p, int q) const {
    return (double{line_[q]} - line_[p] + double(q) * q - double(p) * p) / (2.0 * (q - p));
  }

  std::vector<float> line_;
  std::vector<int> place_;
  std::vector<double> start_;
};

// Distance of each cell, in cells, to the nearest one with `mask` == `wanted`.
std::vector<float> DistanceTo(const std::vector<uint8_t>& mask, uint8_t wanted, int columns,
                              int rows) {
  std::vector<float> distance(mask.size());
  for (size_t i = 0; i < mask.size(); ++i)
    distance[i] = mask[i] == wanted ? 0 : LineTransform::kFar;
  LineTransform transform;
  for (int c = 0; c < columns; ++c) transform.Run(distance.data() + c, rows, columns);
  for (int r = 0; r < rows; ++r) {
    transform.Run(distance.data() + static_cast<size_t>(r) * columns, columns, 1);
  }
  for (float& d : distance) d = std::sqrt(d);
  return distance;
}

absl::Status CoverDiscs(const Eigen::Matrix2Xd& points, const std::vector<float>& spacing,
                        double median_spacing, const RunContext& context, OccupiedArea* area) {
  return SerialFor(points.cols(), context, [&](int64_t i) {
    const Vector2d at = (points.col(i) - area->origin) / area->cell;
    const double radius =
        std::min(kOccupiedArea.own_disc * spacing[i], kPlaneFrame.widest_spacing * median_spacing) /
        area->cell;
    const int reach = static_cast<int>(std::ceil(radius));
    const int column = static_cast<int>(at.x()), row = static_cast<int>(at.y());
    for (int r = std::max(0, row - reach); r <= std::min(area->rows - 1, row + reach); ++r) {
      for (int c = std::max(0, column - reach); c <= std::min(area->columns - 1, column + reach);
           ++c) {
        const Vector2d offset = Vector2d(c + 0.5, r + 0.5) - at;
        if ((c == column && r == row) || offset.squaredNorm() <= radius * radius) {
          area->inside[static_cast<size_t>(r) * area->columns + c] = 1;
        }
      }
    }
  });
}

}  // namespace

double OccupiedArea::area() const {
  return cell * cell * static_cast<double>(std::count(inside.begin(), inside.end(), 1));
}

double OccupiedArea::Depth(const Vector2d& position) const {
  const Vector2d at = (position - origin) / cell - Vector2d(0.5, 0.5);
  const double x = std::clamp(at.x(), 0.0, columns - 1.001);
  const double y = std::clamp(at.y(), 0.0, rows - 1.001);
  const int c = static_cast<int>(x), r = static_cast<int>(y);
  const double s = x - c, t = y - r;
  const size_t i = static_cast<size_t>(r) * columns + c;
  return (1 - t) * ((1 - s) * depth[i] + s * depth[i + 1]) +
         t * ((1 - s) * depth[i + columns] + s * depth[i + columns + 1]);
}

void FillHoles(double smallest_hole, BoundaryRule boundary, OccupiedArea* area) {
  std::vector<uint8_t> seen(area->inside);
  std::vector<int> hole;
  const int columns = area->columns, rows = area->rows;
  for (int seed = 0; seed < columns * rows; ++seed) {
    if (seen[seed] != 0) continue;
    bool outer = false;
    seen[seed] = 1;
    hole.assign(1, seed);
    for (size_t k = 0; k < hole.size(); ++k) {
      const int c = hole[k] % columns, r = hole[k] / columns;
      outer |= c == 0 || r == 0 || c == columns - 1 || r == rows - 1;
      const int around[4] = {c > 0 ? hole[k] - 1 : -1, c < columns - 1 ? hole[k] + 1 : -1,
                             r > 0 ? hole[k] - columns : -1, r < rows - 1 ? hole[k] + columns : -1};
      for (const int next : around) {
        if (next < 0 || seen[next] != 0) continue;
        seen[next] = 1;
        hole.push_back(next);
      }
    }
    const double size = area->cell * area->cell * static_cast<double>(hole.size());
    if (outer || (boundary == BoundaryRule::kKeep && size >= smallest_hole)) continue;
    for (const int i : hole) area->inside[i] = 1;
  }
  const std::vector<float> to_outside = DistanceTo(area->inside, 0, columns, rows);
  const std::vector<float> to_inside = DistanceTo(area->inside, 1, columns, rows);
  area->depth.resize(area->inside.size());
  const auto cell = static_cast<float>(area->cell);
  for (size_t i = 0; i < area->depth.size(); ++i) {
    area->depth[i] = cell * (area->inside[i] != 0 ? to_outside[i] - 0.5F : 0.5F - to_inside[i]);
  }
}

absl::StatusOr<OccupiedArea> FindOccupiedArea(const Eigen::Matrix2Xd& points,
                                              const std::vector<float>& spacing,
                                              double median_spacing, double smallest_hole,
                                              BoundaryRule boundary, const RunContext& context) {
  OccupiedArea area;
  const Vector2d low = points.rowwise().minCoeff(), high = points.rowwise().maxCoeff();
  area.cell =
      std::max({median_spacing, (high - low).maxCoeff() / kOccupiedArea.largest_raster, 1e-9});
  const double closing = std::max(1.0, kCommon.gap_spacings * median_spacing / area.cell);  // cells
  const double margin = closing + kPlaneFrame.widest_spacing + 2;
  area.origin = low - Vector2d::Constant(margin * area.cell);
  const Vector2d size = (high - low) / area.cell;
  area.columns = static_cast<int>(size.x() + 2 * margin) + 1;
  area.rows = static_cast<int>(size.y() + 2 * margin) + 1;
  area.inside.assign(static_cast<size_t>(area.columns) * area.rows, 0);
  RILIEVO_RETURN_IF_ERROR(CoverDiscs(points, spacing, median_spacing, context, &area));

  std::vector<float> distance = DistanceTo(area.inside, 1, area.columns, area.rows);
  for (size_t i = 0; i < distance.size(); ++i) area.inside[i] = distance[i] <= closing ? 1 : 0;
  // Back by half a spacing more than forth: the discs reached out over the points.
  const double back = closing + 0.5 * median_spacing / area.cell;
  distance = DistanceTo(area.inside, 0, area.columns, area.rows);
  for (size_t i = 0; i < distance.size(); ++i) area.inside[i] = distance[i] > back ? 1 : 0;
  FillHoles(smallest_hole, boundary, &area);
  return area;
}

}  // namespace rilievo
