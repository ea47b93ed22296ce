#include "core/surface/measure_part.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/base/freed_memory.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/surface/nearest_in_pages.h"
#include "core/surface/one_way_distances.h"
#include "core/surface/part_triangles.h"
#include "core/surface/surface_samples.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr double kUnknown = std::numeric_limits<double>::infinity();

// How far samples and vertices of a part are from the points.
class PartToPoints {
 public:
  // `near`: the points within kNearPart of the part's box; null: none.
  PartToPoints(const Shape& part, const SearchableShape* near, const PointPages& points,
               const RunContext& context)
      : part_(part), near_(near), context_(context), far_(points) {}

  absl::Status AskSamples(const SurfaceSamples& samples, MeasuredPart* found) {
    std::vector<double> squared(samples.faces.size(), kUnknown), across = squared;
    if (near_ != nullptr) {
      RILIEVO_ASSIGN_OR_RETURN(squared, SquaredAcrossCloud(part_, samples, near_->shape,
                                                           near_->tree, context_, &across));
    }
    for (size_t i = 0; i < squared.size(); ++i) {
      if (squared[i] > kNearPart * kNearPart) {
        RILIEVO_RETURN_IF_ERROR(Settle(samples, i, &squared[i], &across[i]));
      }
      found->largest = std::max(found->largest, squared[i]);
      if (IsFilled(part_, samples.faces[i])) continue;
      found->across_sum += across[i];
      found->across_count += 1;
    }
    found->squared = std::move(squared);
    return absl::OkStatus();
  }

  // Those that may be farther than `largest`, which becomes that of all.
  absl::Status AskVertices(double* largest) {
    if (near_ != nullptr) {
      RILIEVO_ASSIGN_OR_RETURN(
          const double bound,
          LargestSquaredDistance(
              part_.vertices.cols(), [&](int64_t i) -> Vector3d { return part_.vertices.col(i); },
              near_->tree, *largest, context_));
      if (bound <= std::max(*largest, kNearPart * kNearPart)) {
        *largest = bound;
        return absl::OkStatus();
      }
    }
    int hint = -1;
    std::optional<Vector3d> far_hint;
    for (int64_t i = 0; i < part_.vertices.cols(); ++i) {
      if (i % kSearchBlock == 0) RILIEVO_RETURN_IF_ERROR(context_.CheckStop());
      const Vector3d vertex = part_.vertices.col(i);
      if (far_hint && (vertex - *far_hint).squaredNorm() <= *largest) continue;
      double squared = kUnknown;
      if (near_ != nullptr) {
        const ClosestPointTree::Hit hit = near_->tree.Closest(vertex, hint);
        hint = hit.item;
        squared = hit.squared_distance;
      }
      if (squared > std::max(*largest, kNearPart * kNearPart)) {
        RILIEVO_ASSIGN_OR_RETURN(const auto found, far_.Search(vertex, squared));
        if (found) {
          squared = found->squared_distance;
          far_hint = found->point;
        }
      }
      *largest = std::max(*largest, squared);
    }
    return absl::OkStatus();
  }

 private:
  // Of a sample whose nearest point may lie elsewhere.
  absl::Status Settle(const SurfaceSamples& samples, size_t i, double* squared, double* across) {
    const Vector3d place = samples.places.col(static_cast<Eigen::Index>(i));
    RILIEVO_ASSIGN_OR_RETURN(const auto found, far_.Search(place, *squared));
    if (!found) return absl::OkStatus();
    const auto triangle = part_.triangles.col(samples.faces[i]);
    const Vector3d a = part_.vertices.col(triangle[0]);
    const Vector3d normal =
        (part_.vertices.col(triangle[1]) - a).cross(part_.vertices.col(triangle[2]) - a);
    *squared = found->squared_distance;
    *across = SquaredAcross(found->point, normal.normalized(), found->gap, place);
    return absl::OkStatus();
  }

  const Shape& part_;
  const SearchableShape* near_;
  const RunContext& context_;
  NearestInPages far_;
};

void KeepDistances(const GatheredPoints& gathered, const std::vector<double>& squared,
                   MeasuredPart* part) {
  size_t before = 0;  // points of the pages so far
  for (const GatheredPoints::OfPage& page : gathered.pages) {
    part->pages.push_back(page.page);
    part->in_reach.resize((before + page.points + 7) / 8);
    for (int64_t i = page.begin; i < page.end; ++i) {
      const size_t place = before + gathered.places[i];
      part->in_reach[place / 8] |= static_cast<uint8_t>(1 << place % 8);
      part->squared_of_points.push_back(static_cast<float>(squared[i]));
    }
    before += page.points;
  }
}

// Whether sums over parts like this one make sense.
bool IsPlausible(const MeasuredPart& part) {
  constexpr int64_t kMost = int64_t{1} << 40;  // of triangles and vertices
  const auto is_count = [](int64_t count) { return count >= 0 && count < kMost; };
  const auto is_square = [](double x) { return x >= 0 && !std::signbit(x); };
  const auto is_sum = [&](double x) { return is_square(x) && std::isfinite(x); };
  return part.box.allFinite() && is_count(part.folds) && is_count(part.across_count) &&
         std::all_of(part.source_counts.begin(), part.source_counts.end(), is_count) &&
         is_sum(part.largest) && is_sum(part.across_sum) &&
         std::all_of(part.squared.begin(), part.squared.end(), is_sum) &&
         std::all_of(part.squared_of_points.begin(), part.squared_of_points.end(), is_square);
}

}  // namespace

absl::Status CheckMeasure(const SurfaceParts& surface, const MeasureOptions& options) {
  if (!(surface.area > 0)) {
    return absl::InvalidArgumentError("the surface has no area, so no samples of it can be taken");
  }
  return options.Validate();
}

absl::StatusOr<MeasuredPart> MeasurePart(const SurfaceParts& surface, int i,
                                         const MeasureOptions& options, const RunContext& context,
                                         const PointPages& points) {
  RILIEVO_RETURN_IF_ERROR(CheckMeasure(surface, options));
  RILIEVO_ASSIGN_OR_RETURN(const PartTriangles triangles, surface.triangles(i, context));
  const Shape& part = triangles.shape;
  const Eigen::AlignedBox3d box = BoxOfShape(part);
  MeasuredPart found;
  found.box << box.min(), box.max();
  found.folds = triangles.folds;
  found.source_counts = triangles.source_counts;
  SurfaceSamples samples;
  samples.places = SamplePiece(
      part.vertices, part.triangles, surface.area / static_cast<double>(options.samples),
      MixBits(context.seed ^ MixBits(static_cast<uint64_t>(i))), &samples.faces);
  const auto ask = [&](const SearchableShape* near) -> absl::Status {
    PartToPoints way(part, near, points, context);
    RILIEVO_RETURN_IF_ERROR(way.AskSamples(samples, &found));
    return way.AskVertices(&found.largest);
  };
  const Vector3d margin = Vector3d::Constant(kNearPart);
  RILIEVO_ASSIGN_OR_RETURN(
      GatheredPoints near,
      PointsWithin(Eigen::AlignedBox3d(box.min() - margin, box.max() + margin), points, context));
  if (near.pages.empty()) {
    RILIEVO_RETURN_IF_ERROR(ask(nullptr));
    return found;
  }
  {
    RILIEVO_ASSIGN_OR_RETURN(const SearchableShape searchable,
                             MakeSearchable(std::move(near.shape), context));
    RILIEVO_RETURN_IF_ERROR(ask(&searchable));
    near.shape.vertices = searchable.shape.vertices;
  }
  NearestOfParts nearest(near.shape.vertices,
                         std::vector<double>(near.shape.vertices.cols(), kUnknown));
  RILIEVO_RETURN_IF_ERROR(nearest.Ask(part, 2 * kNearPart, context));
  KeepDistances(near, nearest.squared(), &found);
  return found;
}

absl::Status TakeDistances(MeasuredPart* part, PointPages* points) {
  const auto wrong = [] { return absl::InternalError("the distances are not of these points"); };
  if (!IsPlausible(*part)) return wrong();
  const std::vector<uint8_t>& in_reach = part->in_reach;
  auto next = part->squared_of_points.cbegin();
  size_t before = 0;
  for (const int page : part->pages) {
    if (page < 0 || page >= points->count()) return wrong();
    RILIEVO_ASSIGN_OR_RETURN(std::vector<float> distances, points->Distances(page));
    if (in_reach.size() < (before + distances.size() + 7) / 8) return wrong();
    for (size_t i = 0; i < distances.size(); ++i) {
      const size_t place = before + i;
      if ((in_reach[place / 8] >> place % 8 & 1) == 0) continue;
      if (next == part->squared_of_points.cend()) return wrong();
      distances[i] = std::min(distances[i], *next++);
    }
    before += distances.size();
    RILIEVO_RETURN_IF_ERROR(points->WriteDistances(page, distances));
  }
  if (next != part->squared_of_points.cend()) return wrong();
  FreeMemoryOf(&part->pages);
  FreeMemoryOf(&part->in_reach);
  FreeMemoryOf(&part->squared_of_points);
  return absl::OkStatus();
}

}  // namespace rilievo
