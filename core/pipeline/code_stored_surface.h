// A surface whose heights lie on disk as a file with its certificate, some groups at a time.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "absl/status/statusor.h"
#include "core/codec/container/dss.h"
#include "core/paging/scratch_folder.h"
#include "core/paging/shared_parts.h"
#include "core/pipeline/code_surface.h"
#include "core/pipeline/reconstruct.h"
#include "core/pipeline/stage_scope.h"
#include "core/surface/displaced_surface.h"
#include "core/surface/measure_error.h"
#include "core/surface/measure_parts.h"
#include "core/surface/point_pages.h"
#include "core/surface/stored_surface.h"

namespace rilievo {

// Most control faces of a group where blocks of `block_vertices` are coded at a time; unset where
// the surface is to be coded at once: it is not larger, has too few levels or faces for groups, or
// the options ask for none.
std::optional<int> GroupFacesFor(const StoredSurface& surface, const PartCutter& cutter,
                                 int64_t block_vertices, const EncodeOptions& options);

// What of the thinned scan tells how exactly its surface is worth coding.
struct ThinnedPoints {
  Eigen::Matrix3Xd some;  // SomePoints()
  double median_spacing = 0, median_noise = 0;
  double leverage = 1;  // of the heights from them; from all points it is less
};

struct BlockSize {
  int64_t vertices = 0;   // of the finest level, that are in memory at a time
  int64_t points = 0;     // about, that a part is measured against
  bool in_groups = true;  // coded so, with groups as GroupFacesFor() gives them; else at once
};

struct CodedStoredSurface {
  EncodedSurface encoded;  // with the certificate in it
  DssMetadata metadata;
  UncodedError uncoded;
  TwoSidedError error;  // as the certificate states it; zero when not measured
};

// Of all vertices, those of this source; `counts`: of each source.
double ShareOfSource(HeightSource source, const std::array<int64_t, 3>& counts);

// All heights in memory.
absl::StatusOr<DisplacedSurface> ReadWhole(const StoredSurface& stored, const PartCutter& cutter);

// What CodeSurface(), KeepError() and Certify() do with a surface in memory. The errors are those
// against all `points`. In a scratch folder that keeps its files what is coded, but not measured,
// is found again, and where `shared`, which may be null, has it.
absl::StatusOr<CodedStoredSurface> CodeStoredSurface(
    const StoredSurface& surface, const PartCutter& cutter, const ThinnedPoints& thinned,
    PointPages* points, double position_step, const DssMetadata& metadata, const BlockSize& block,
    const ScratchFolder& scratch, SharedParts* shared, const ReconstructOptions& options,
    const PipelineContext& context);

// Codes blocks for the process that leads `shared`, and measures parts of what that makes of them;
// `points` may be null: then nothing is measured.
absl::Status HelpToCode(const StoredSurface& surface, const PartCutter& cutter, PointPages* points,
                        double position_step, const BlockSize& block, SharedParts* shared,
                        const ReconstructOptions& options, const PipelineContext& context);

// The error of a file that is whole up to its last layer, in memory as above. `points` may be null:
// then folds and sources alone. `sizes` and `options`: those it was made with.
absl::StatusOr<PartsError> MeasureDssByParts(std::span<const uint8_t> dss, const PartSizes& sizes,
                                             PointPages* points, const ReconstructOptions& options,
                                             const PipelineContext& context);

}  // namespace rilievo
