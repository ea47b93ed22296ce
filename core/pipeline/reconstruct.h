// Points in, displaced subdivision surface out: the stages in order.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/container/dss.h"
#include "core/control/build_control_mesh.h"
#include "core/displacement/sample_displacement.h"
#include "core/domain/fit_loop_domain.h"
#include "core/geometry/point_cloud.h"
#include "core/geometry/scan_place.h"
#include "core/meshes/check_mesh.h"
#include "core/paging/paged_scan.h"
#include "core/paging/shared_parts.h"
#include "core/scan/scan_surface.h"
#include "core/surface/displaced_surface.h"
#include "core/surface/measure_error.h"

namespace rilievo {

// Options of control and encode as lengths in the scan's unit: they become fractions of the
// diagonal once that is known. Each is above 0, and excludes the same option given as a fraction.
struct OptionLengths {
  std::optional<double> close_holes_below;       // of control
  std::optional<double> bridge_gaps_below;       // likewise
  std::optional<double> max_error, height_step;  // of encode
  absl::Status Validate(const ControlOptions& control, const EncodeOptions& encode) const;
};

struct ReconstructOptions {
  CheckOptions check;
  ScanOptions scan;
  ControlOptions control;
  FitOptions fit;
  DisplacementOptions displacement;
  EncodeOptions encode;
  OptionLengths lengths;
  ScanPlace place;  // into the .dss as it is
  // Levels of heights; unset: chosen so that the finest vertices are as dense as the points. [0,
  // 8].
  std::optional<int> max_level;
  // Faces of the finest level at most: a level chosen here stays below, one asked for is refused.
  // [1, 2^30].
  int64_t max_surface_faces = int64_t{1} << 30;
  // Measure the two-sided error of the decoded surface against the points at the end.
  bool measure = true;
  absl::Status Validate() const;
};

// What happened on the way. Distances are fractions of the diagonal.
struct ReconstructReport {
  int64_t points_in = 0;
  int64_t non_finite = 0, duplicates = 0, strays = 0, outliers = 0, island_points = 0;
  int64_t foliage_points =
      0;  // points that fill volumes and are left out; by parts among the outliers
  int64_t points_used = 0;
  MeshFigures mesh;     // no triangles: a scan
  double diagonal = 0;  // scan unit
  ScanPlace place;      // of the options
  double median_spacing = 0, median_noise = 0;
  double normal_disagreement = 0;
  SightFigures stations, normals;  // no points: none given, or not wanted
  std::string topology;            // "planar", "spherical", "arbitrary", "user"
  std::string topology_reason;
  int components = 0, boundary_loops = 0, genus = 0;
  bool close_asked = false;  // BoundaryRule::kClose
  int control_vertices = 0, control_faces = 0, max_level = 0;
  int64_t surface_vertices = 0, surface_faces = 0;  // at max_level
  double domain_rms = 0;                            // cloud to domain surface after the fit
  double border_miss = 0;                           // of a border that is to be exact, see Domain
  int fit_rounds = 0;
  bool fit_converged = false;
  int64_t heights_measured = 0, heights_smoothed = 0, heights_filled = 0;
  TwoSidedError error;  // a = decoded surface, b = points; zero when not measured
  int64_t encoded_bytes = 0;
  int64_t color_bytes = 0;         // of these; 0: no colours
  double color_rms = 0;            // decoded against given colours of the vertices, see CodedColors
  bool colors_left_out = false;    // the bytes asked for had no room for them
  double max_error = 0;            // encode.max_error; 0: not asked for
  double uncoded_error = 0;        // error.across_rms before coding; measured where asked for
  bool error_unreachable = false;  // error.across_rms is above it
  double stage_seconds[kStageCount] = {};
  double total_seconds = 0;
  std::vector<std::string> warnings;  // full sentences for people
};

struct Reconstruction {
  DisplacedSurface surface;
  EncodedSurface encoded;
  ReconstructReport report;
};

// The scan as a surface. RESOURCE_EXHAUSTED when memory runs out or the surface would have more
// than max_surface_faces; INTERNAL when a library threw.
absl::StatusOr<Reconstruction> Reconstruct(const PointCloud& scan,
                                           const ReconstructOptions& options,
                                           const RunContext& context);
// The same; the scan's memory goes as soon as its points have been checked.
absl::StatusOr<Reconstruction> ReconstructAndDrop(PointCloud scan,
                                                  const ReconstructOptions& options,
                                                  const RunContext& context);

// What of a scan on disk and of its surface is in memory at a time, at most. Each in [1024, 2^31).
struct PartSizes {
  int64_t coarse_points = 4'000'000;  // that the coarse pass sees
  int64_t part_points = 1'000'000;    // of a part, its halo with it
  // Of the finest level: those of a block of the control faces, without its halo, that is coded and
  // measured. A surface of no more is coded at once.
  int64_t block_vertices = 500'000;

  // The others in the same ratio to `part_points` as by default.
  static PartSizes Of(int64_t part_points) {
    return {4 * part_points, part_points, part_points / 2};
  }
  absl::Status Validate() const;
};

// Files that a scan and its parts have in a scratch folder, at most.
inline constexpr int kFilesOfParts = 7;

// A scan on disk as a surface, in memory that hardly grows with the points (for each two thirds of
// a byte, where its pages lie, and one bit, whether it is left out), and not with the surface:
// control mesh and domain come of a thinned scan (PagedScan::Thinned), the heights of all points, a
// part of the control faces at a time (heights_from_pages.h), and a surface of more than
// block_vertices is coded and measured in blocks (code_stored_surface.h); its heights are in the
// bytes alone, not in Reconstruction::surface. The errors that are asked for and stated are those
// against all points. INVALID_ARGUMENT besides where the options ask for what only points in memory
// tell. `shared`: where other processes have the same pages, sizes, options and seed, and do some
// of the parts; the bytes are the same.
absl::StatusOr<Reconstruction> ReconstructPaged(const PagedScan& scan, const PartSizes& sizes,
                                                const ReconstructOptions& options,
                                                const RunContext& context,
                                                SharedParts* shared = nullptr);
// Does parts of such a run until all are done; the surface is left to the process that leads.
absl::Status HelpWithParts(const PagedScan& scan, const PartSizes& sizes,
                           const ReconstructOptions& options, const RunContext& context,
                           SharedParts* shared);

}  // namespace rilievo
