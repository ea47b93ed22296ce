// A surface whose heights lie on disk as a file with its certificate, some groups at a time.
#pragma once

#include <cstdint>
#include <optional>

#include "absl/status/statusor.h"
#include "core/codec/container/dss.h"
#include "core/pipeline/code_surface.h"
#include "core/pipeline/reconstruct.h"
#include "core/pipeline/stage_scope.h"
#include "core/points/oriented_cloud.h"
#include "core/surface/measure_error.h"
#include "core/surface/stored_surface.h"

namespace rilievo {

// Most control faces of a group where blocks of `block_vertices` are coded at a time; unset where
// the surface is to be coded at once: it is not larger, has too few levels or faces for groups, or
// the options ask for none.
std::optional<int> GroupFacesFor(const StoredSurface& surface, const PartCutter& cutter,
                                 int64_t block_vertices, const EncodeOptions& options);

struct CodedStoredSurface {
  EncodedSurface encoded;  // with the certificate in it
  DssMetadata metadata;
  UncodedError uncoded;
  TwoSidedError error;  // as the certificate states it; zero when not measured
};

// What CodeSurface(), KeepError() and Certify() do with a surface in memory. options.encode has
// group_faces, as GroupFacesFor() gives them. The errors are those against `cloud`.
absl::StatusOr<CodedStoredSurface> CodeStoredSurface(
    const StoredSurface& surface, const PartCutter& cutter, OrientedCloud cloud,
    double position_step, const DssMetadata& metadata, int64_t block_vertices,
    const ReconstructOptions& options, const PipelineContext& context);

}  // namespace rilievo
