// A surface brought up to date by a new scan of it, or of the part that changed.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/point_cloud.h"
#include "core/surface/measure_error.h"

namespace rilievo {

struct UpdateOptions {
  // Whether the scan shows all there is to see: then heights that were measured where it has no
  // point become filled ones. Else it may be of a part of the surface.
  bool whole = false;
  // That memory was set aside for, of the finest level.
  int64_t most_vertices = std::numeric_limits<int64_t>::max();
};

// Distances of the points of the scan from the surface, fractions of the diagonal.
struct UpdateReport {
  int64_t points = 0, non_finite = 0;
  int64_t contradicting = 0;  // points where the surface is made anew
  double noise = 0;           // of the scan, a standard deviation
  DistanceSummary before, after;
  int64_t heights = 0, heights_anew = 0, heights_filled = 0;  // of the surface; filled: of the anew
  int groups = 0, groups_changed = 0;  // of control faces; none: the file has no groups
  int64_t update_bytes = 0;            // that the file grew by; the others are as they were
};

struct SurfaceUpdate {
  std::vector<uint8_t> dss;
  std::vector<int64_t> chunk_bytes;  // see DecodedSurface
  UpdateReport report;
};

// The heights of a whole .dss made anew where `scan` (scan frame of the surface, in any order)
// contradicts it (CompareWithSurface), and in a rim around these places, along which they pass over
// into those that were there. The control mesh stays as it is. Heights and sources elsewhere stay,
// to the last bit, and so do the bytes of the file: what is new is one chunk at its end
// (EncodeUpdate), coded with the step that the heights of the file have. Colours stay as they
// were. Without a contradiction the bytes are those given.
//
// FAILED_PRECONDITION when the scan lies elsewhere, when changes are larger than heights reach
// (5 % of the diagonal, or half a radius of curvature inward), and as EncodeUpdate(); the remedy is
// a new reconstruction. INVALID_ARGUMENT for a scan without finite points, and for more vertices
// than options.most_vertices; else the errors of DecodeDss() of the file given, and of the stages.
absl::StatusOr<SurfaceUpdate> UpdateSurface(std::span<const uint8_t> dss, const PointCloud& scan,
                                            const UpdateOptions& options,
                                            const RunContext& context);

}  // namespace rilievo
