// The chunks of a file around its heights.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/container/dss.h"
#include "core/codec/container/dss_header.h"
#include "core/codec/heights/encode_smoothed_flags.h"
#include "core/codec/heights/height_encoder.h"
#include "core/codec/mesh/face_groups.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/spatial_frame.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// Before the heights are coded.
struct DssDraft {
  DssHeader header;
  MeshTopology control;
  std::vector<uint8_t> coded_mesh;  // crease tags and control mesh, what follows the header
  FaceGroups groups;                // where header.group_limit > 0
};

// The step of the heights at first.
double FirstHeightStep(const EncodeOptions& options);

// INVALID_ARGUMENT where the mesh is not as PrepareControlMesh() makes it.
absl::StatusOr<DssDraft> DraftDss(const SpatialFrame& frame, const ControlMesh& mesh,
                                  const MeshTopology& control, int max_level,
                                  const DssMetadata& metadata, const EncodeOptions& options);

// Heights as the options ask for them. `bytes_left`: of max_bytes, after chunk 0.
absl::StatusOr<EncodedHeights> EncodeHeights(const HeightCoding& encoder,
                                             const EncodeOptions& options, int64_t bytes_left,
                                             const RunContext& context);

// The flags of smoothed heights for a file whose last `plain_levels` levels have no chunk; `bytes`
// and `most`: see EncodeSmoothedFlags.
using SmoothedCoding =
    std::function<absl::StatusOr<EncodedFlags>(size_t plain_levels, int64_t bytes, int64_t most)>;

// RESOURCE_EXHAUSTED when options.max_bytes cannot be kept.
absl::StatusOr<EncodedSurface> FinishDss(const DssDraft& draft, const HeightCoding& heights,
                                         bool has_filled, const SmoothedCoding& smoothed,
                                         const EncodeOptions& options, const RunContext& context);

// The first chunk. INVALID_ARGUMENT for a header that a reader would refuse.
absl::StatusOr<std::vector<uint8_t>> ControlChunk(const DssHeader& header,
                                                  std::span<const uint8_t> coded_mesh);

}  // namespace rilievo
