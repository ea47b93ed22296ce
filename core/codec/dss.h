// The .dss container: a displaced subdivision surface as bytes, coarse first.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {

struct EncodeOptions {
  // Step of the height quantiser at the finest level, fraction of the diagonal. (0, 0.01].
  double height_step = 2e-5;
  // Step of the control-point quantiser, fraction of the diagonal. (0, 0.01]. It costs no accuracy,
  // because heights are sampled over the quantised mesh (see PrepareControlMesh), and next to no
  // height bytes: from 1e-6 to 1e-4 the heights of a rabbit with 823 control points stayed at
  // 108.8 KB while its control mesh fell from 5.4 to 3.3 KB.
  double position_step = 1e-4;
  absl::Status Validate() const;
};

// What was known of the surface when it was made; travels in the header, all optional.
struct DssMetadata {
  std::string generator;  // program and version
  double error_rms = -1;  // two-sided against the scan, fraction of the diagonal; -1: unknown
  double error_max = -1;
  int64_t scan_points = 0;
  std::string road;  // "planar", "spherical", "arbitrary", "user"
};

// Chunk 0 is header + control mesh; chunk 1 + l the heights that level l adds. Their concatenation
// is the file, and any prefix of whole chunks decodes, to a surface with fewer levels.
struct EncodedSurface {
  std::vector<std::vector<uint8_t>> chunks;
  std::vector<uint8_t> Concatenate() const;
};

// Nothing of the control mesh is lost, so it must be as PrepareControlMesh (prepare_control_mesh.h)
// makes it with this position_step: INVALID_ARGUMENT when its order is another, when a control
// point is off the grid, when a height is not finite or beyond 2^22 steps, or when the number of
// heights does not fit. A height comes back within height_step / 2, its source exactly.
absl::StatusOr<EncodedSurface> EncodeDss(const DisplacedSurface& surface,
                                         const DssMetadata& metadata, const EncodeOptions& options,
                                         const RunContext& context);

struct DecodedSurface {
  DisplacedSurface surface;
  DssMetadata metadata;
  int format_version = 0;
  // Of the whole file; surface.max_level is smaller when the last chunks are not there yet. When
  // chunk 0 came alone, the surface has level 0, all heights zero and kFilled.
  int declared_max_level = 0;
  std::vector<int64_t> chunk_bytes;
};

// DATA_LOSS for a truncated or corrupted stream (names the chunk), INVALID_ARGUMENT for what is no
// .dss at all, UNIMPLEMENTED for a newer version. Counts in the bytes are checked against the bytes
// that are there before anything is allocated (docs/dss-format.md states the law). A prefix that
// ends with a whole chunk is no error.
absl::StatusOr<DecodedSurface> DecodeDss(std::span<const uint8_t> bytes, const RunContext& context);

}  // namespace rilievo
