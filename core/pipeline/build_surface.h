// From one control mesh to the bytes of a surface.
#pragma once

#include <optional>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/container/dss.h"
#include "core/geometry/triangle_mesh.h"
#include "core/pipeline/reconstruct.h"
#include "core/scan/scan_surface.h"
#include "core/surface/closest_point_tree.h"
#include "core/surface/displaced_surface.h"
#include "core/surface/measure_error.h"

namespace rilievo {

// The level, 1 to 6, whose displaced vertices are about as dense as so many points.
int LevelAsDenseAs(double points, int64_t control_faces);

// A fitted control mesh, rounded as the file will hold it.
struct Domain {
  ControlMesh mesh;
  double position_step = 0;
  ControlMesh fitted;  // before rounding
};

// The same rounded to another step.
absl::StatusOr<Domain> RoundDomain(ControlMesh fitted, double position_step);

// The Loop surface of `start`, fitted to the points. Fills in what the report says of it, the
// control mesh's counts too.
absl::StatusOr<Domain> FitDomain(const ScanSurface& scan, const ControlMesh& start,
                                 const ReconstructOptions& options, const RunContext& context,
                                 ReconstructReport* report);

// Heights over the domain.
struct UncodedSurface {
  DisplacedSurface surface;
  Shape shape;  // of the finest level, unit frame
  double position_step = 0;
};

// Samples heights over the domain, and cuts it where the scan turns out to have an opening. Fills
// in what the report says of these stages. From here on only the scan's cloud is asked for.
absl::StatusOr<UncodedSurface> SampleSurfaceHeights(const ScanSurface& scan, Domain domain,
                                                    const ReconstructOptions& options,
                                                    const RunContext& context,
                                                    ReconstructReport* report);

struct CodedSurface {
  DisplacedSurface surface;  // before coding
  EncodedSurface encoded;    // room is kept for the figures of the certificate
  DssMetadata metadata;
  double position_step = 0;
  // Of the scan's points, where it was asked for.
  std::optional<ClosestPointTree> points_tree = std::nullopt;
};

// Measures how far the surface lies from the points and encodes it. Fills in what the report says
// of these stages; its error is that of the surface before coding: with encode.max_error as the
// certificate measures it, else from the points alone. `metadata`: what is known before.
// RESOURCE_EXHAUSTED also when encode.max_bytes cannot be kept. `with_tree`: makes that of the
// points beside.
absl::StatusOr<CodedSurface> CodeSurface(const OrientedCloud& cloud, UncodedSurface sampled,
                                         const DssMetadata& metadata,
                                         const ReconstructOptions& options,
                                         const RunContext& context, ReconstructReport* report,
                                         bool with_tree = false);

// Both, without the tree.
absl::StatusOr<CodedSurface> BuildSurface(const ScanSurface& scan, Domain domain,
                                          const DssMetadata& metadata,
                                          const ReconstructOptions& options,
                                          const RunContext& context, ReconstructReport* report);

// The surface coded once more, with an RMS error of the heights of `coding_error`.
absl::StatusOr<EncodedSurface> RecodeSurface(const CodedSurface& coded, double coding_error,
                                             const ReconstructOptions& options,
                                             const RunContext& context, ReconstructReport* report);

}  // namespace rilievo
