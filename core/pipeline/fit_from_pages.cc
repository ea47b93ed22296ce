#include "core/pipeline/fit_from_pages.h"

#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/base/freed_memory.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/saved_value.h"
#include "core/pipeline/settings.h"
#include "core/points/point_index.h"

namespace rilievo {
namespace {

constexpr char kFitName[] = "fit";

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

// The three corners of each of a part's faces, one after the other; none where there are no points.
struct FitOfPart {
  Eigen::Matrix3Xd corners;
  double squares = 0, points = 0;  // of the points' offsets
};

template <typename Archive, typename Fit>
void VisitFitOfPart(Archive& archive, Fit& fit) {
  archive(fit.corners);
  archive(fit.squares);
  archive(fit.points);
}

bool IsFitOf(const FitOfPart& fit, size_t faces) {
  const auto columns = static_cast<size_t>(fit.corners.cols());
  return (columns == 0 || columns == 3 * faces) && fit.corners.allFinite() &&
         std::isfinite(fit.squares) && std::isfinite(fit.points) && fit.points >= 0;
}

absl::StatusOr<FitOfPart> FitPart(const FacePart& part, const KnownPoints& points,
                                  const FaceParts& parts, const PartCutter& cutter,
                                  const FitOptions& options, const RunContext& context) {
  const SubMesh sub = cutter.Cut(part.faces, kFitFromPages.rings_around);
  RILIEVO_ASSIGN_OR_RETURN(const OrientedCloud cloud,
                           CloudIn(parts.ReachOf(sub.faces), points, context));
  if (cloud.points.cols() == 0) return FitOfPart();
  RILIEVO_ASSIGN_OR_RETURN(const PointIndex index, PointIndex::BuildOver(cloud.points, context));
  RILIEVO_ASSIGN_OR_RETURN(const DomainFit fit,
                           FitLoopDomain(cloud, index, sub.mesh, options, context));
  const auto count = static_cast<double>(cloud.points.cols());
  FitOfPart found{{}, count * fit.rms_after * fit.rms_after, count};
  found.corners.resize(3, static_cast<Eigen::Index>(3 * part.faces.size()));
  Eigen::Index column = 0;
  for (const int inner : PlacesOf(part.faces, sub.faces)) {
    for (const int v : sub.mesh.faces.col(inner)) {
      found.corners.col(column++) = fit.control_mesh.vertices.col(v);
    }
  }
  return found;
}

// A control point between parts is that of the first one.
DomainFit Assembled(const DomainFit& start, const std::vector<FacePart>& parts,
                    const std::vector<FitOfPart>& fits, const MeshTopology& topology) {
  DomainFit whole = start;
  std::vector<uint8_t> taken(static_cast<size_t>(topology.vertex_count), 0);
  double squares = 0, points = 0;
  for (size_t p = 0; p < parts.size(); ++p) {
    if (fits[p].corners.cols() == 0) continue;
    squares += fits[p].squares;
    points += fits[p].points;
    Eigen::Index column = 0;
    for (const int f : parts[p].faces) {
      for (const int v : topology.faces.col(f)) {
        const Eigen::Index corner = column++;
        if (taken[v] != 0) continue;
        taken[v] = 1;
        whole.control_mesh.vertices.col(v) = fits[p].corners.col(corner);
      }
    }
  }
  if (points > 0) whole.rms_after = std::sqrt(squares / points);
  return whole;
}

}  // namespace

absl::StatusOr<DomainFit> FitFromPages(const KnownPoints& points, const FaceParts& parts,
                                       const PartCutter& cutter, const DomainFit& start,
                                       const FitOptions& options, const PartsRun& run,
                                       const RunContext& context) {
  const ScratchFolder& folder = points.scan.scratch_folder();
  if (std::optional<DomainFit> found = FindFit(folder, start)) return *std::move(found);
  const std::vector<FacePart>& face_parts = parts.parts();
  std::vector<FitOfPart> fits(face_parts.size());
  PartsOfStep of_step{.step = PartStep::kFit, .count = static_cast<int>(face_parts.size())};
  of_step.make = [&](int part, const RunContext& own) -> absl::StatusOr<std::vector<uint8_t>> {
    RILIEVO_ASSIGN_OR_RETURN(const FitOfPart found,
                             FitPart(face_parts[part], points, parts, cutter, options, own));
    ValueWriter writer;
    VisitFitOfPart(writer, found);
    return std::move(writer.bytes);
  };
  of_step.take = [&](int part, std::span<const uint8_t> bytes) {
    ValueReader reader(bytes);
    VisitFitOfPart(reader, fits[part]);
    ReleaseToOsAfter(points.scan.size());
    return reader.Finished() && IsFitOf(fits[part], face_parts[part].faces.size())
               ? absl::OkStatus()
               : NotOfPart(PartStep::kFit, part);
  };
  RILIEVO_RETURN_IF_ERROR(RunParts(of_step, run, context));
  DomainFit fit = Assembled(start, face_parts, fits, cutter.topology());
  if (folder.keeps()) {
    ValueWriter writer;
    VisitFit(writer, fit);
    RILIEVO_RETURN_IF_ERROR(folder.Save(kFitName, writer.bytes));
  }
  return fit;
}

}  // namespace rilievo
