#include "core/pipeline/fit_from_pages.h"

#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/freed_memory.h"
#include "core/base/status_macros.h"
#include "core/paging/saved_value.h"
#include "core/points/point_index.h"

namespace rilievo {
namespace {

constexpr char kFitName[] = "fit";

// Around a part. With four the control points differ by 0.02 to 0.08 spacings from those of a fit
// of the whole.
constexpr int kRingsAround = 4;

template <typename Archive, typename Fit>
void VisitFit(Archive& archive, Fit& fit) {
  archive(fit.control_mesh.vertices);
  archive(fit.rms_after);
}

std::optional<DomainFit> FindFit(const ScratchFolder& folder, const DomainFit& start) {
  const std::optional<std::vector<uint8_t>> saved = folder.Load(kFitName);
  if (!saved) return std::nullopt;
  DomainFit fit = start;
  ValueReader reader(*saved);
  VisitFit(reader, fit);
  const bool fits = reader.Finished() && fit.control_mesh.vertices.allFinite() &&
                    fit.control_mesh.vertices.cols() == start.control_mesh.vertices.cols();
  return fits ? std::optional(std::move(fit)) : std::nullopt;
}

// Fits one part after the other.
class FitOfParts {
 public:
  FitOfParts(const KnownPoints& points, const FaceParts& parts, const PartCutter& cutter,
             const DomainFit& start, const FitOptions& options)
      : points_(points),
        parts_(parts),
        cutter_(cutter),
        options_(options),
        fit_(start),
        taken_(static_cast<size_t>(cutter.topology().vertex_count), 0) {}

  // Moves the control points of the part's faces that no part before has taken.
  absl::Status Fit(const FacePart& part, const RunContext& context) {
    const SubMesh sub = cutter_.Cut(part.faces, kRingsAround);
    RILIEVO_ASSIGN_OR_RETURN(const OrientedCloud cloud,
                             CloudIn(parts_.ReachOf(sub.faces), points_, context));
    if (cloud.points.cols() == 0) return absl::OkStatus();
    RILIEVO_ASSIGN_OR_RETURN(const PointIndex index, PointIndex::BuildOver(cloud.points, context));
    RILIEVO_ASSIGN_OR_RETURN(const DomainFit fit,
                             FitLoopDomain(cloud, index, sub.mesh, options_, context));
    const auto count = static_cast<double>(cloud.points.cols());
    squares_ += count * fit.rms_after * fit.rms_after;
    fitted_points_ += count;
    for (const int inner : PlacesOf(part.faces, sub.faces)) {
      for (int k = 0; k < 3; ++k) {
        const int v = cutter_.topology().faces(k, sub.faces[inner]);
        if (taken_[v] != 0) continue;
        taken_[v] = 1;
        fit_.control_mesh.vertices.col(v) = fit.control_mesh.vertices.col(sub.mesh.faces(k, inner));
      }
    }
    return absl::OkStatus();
  }

  DomainFit Finish() {
    if (fitted_points_ > 0) fit_.rms_after = std::sqrt(squares_ / fitted_points_);
    return std::move(fit_);
  }

 private:
  const KnownPoints& points_;
  const FaceParts& parts_;
  const PartCutter& cutter_;
  const FitOptions& options_;
  DomainFit fit_;
  std::vector<uint8_t> taken_;              // by control point
  double squares_ = 0, fitted_points_ = 0;  // of the points' offsets
};

}  // namespace

absl::StatusOr<DomainFit> FitFromPages(const KnownPoints& points, const FaceParts& parts,
                                       const PartCutter& cutter, const DomainFit& start,
                                       const FitOptions& options,
                                       const std::function<void(double)>& told,
                                       const RunContext& context) {
  const ScratchFolder& folder = points.scan.scratch_folder();
  if (std::optional<DomainFit> found = FindFit(folder, start)) return *std::move(found);
  FitOfParts of_parts(points, parts, cutter, start, options);
  double done = 0;
  for (const FacePart& part : parts.parts()) {
    told(done++ / static_cast<double>(parts.parts().size()));
    RILIEVO_RETURN_IF_ERROR(of_parts.Fit(part, context));
    ReleaseToOsAfter(points.scan.size());
  }
  DomainFit fit = of_parts.Finish();
  if (folder.keeps()) {
    ValueWriter writer;
    VisitFit(writer, fit);
    RILIEVO_RETURN_IF_ERROR(folder.Save(kFitName, writer.bytes));
  }
  return fit;
}

}  // namespace rilievo
