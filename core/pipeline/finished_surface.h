// A surface with the bytes that state what they are worth.
#pragma once

#include <array>
#include <cstdint>
#include <utility>

#include "absl/status/statusor.h"
#include "core/codec/container/colors.h"
#include "core/geometry/triangle_mesh.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/code_surface.h"
#include "core/pipeline/reconstruct.h"
#include "core/pipeline/stage_scope.h"
#include "core/points/oriented_cloud.h"
#include "core/scan/scan_surface.h"
#include "core/surface/measure_error.h"

namespace rilievo {

// What is measured of a scan once its heights are there; the rest of its memory goes.
inline OrientedCloud CloudAlone(ScanSurface scan) { return std::move(scan.cloud); }

struct FinishedSurface {
  CodedSurface coded;                      // without its bytes
  CertifiedBytes certified;                // these
  std::array<int64_t, 3> source_counts{};  // vertices of each HeightSource
  CodedColors colors;
  int64_t points_used = 0;  // of a scan on disk
};

// Certifies coded->encoded against `mesh`, or the points of `cloud` where it has no triangles.
absl::StatusOr<FinishedSurface> FinishSurface(CodedSurface coded, OrientedCloud cloud, Shape mesh,
                                              const ReconstructOptions& options,
                                              const PipelineContext& context);

}  // namespace rilievo
