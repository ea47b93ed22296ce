// The .dss container: a displaced subdivision surface as bytes, coarse first.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/container/color_code.h"
#include "core/geometry/scan_place.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {

// Of control points, where nothing else was asked for.
inline constexpr double kPositionStep = 4e-4;

// Coarsest step of control points and of heights, fraction of the diagonal.
inline constexpr double kMaxStep = 0.01;

struct EncodeOptions {
  // Step of the height quantiser at the finest level, fraction of the diagonal. (0, 0.01]; 0: not
  // asked for, 2e-5 unless max_error or max_bytes say otherwise. Coarser
  // levels get steps that cost the same error (HeightEncoder). The RMS error of the heights stays
  // below about a third of it on rough surfaces, a tenth on smooth ones. Not used with max_error or
  // max_bytes.
  double height_step = 0;
  // Step of the control-point quantiser, fraction of the diagonal. (0, 0.01]; 0: not asked for,
  // kPositionStep here, and what suits the mesh in the pipeline. It costs hardly any
  // accuracy, because heights are sampled over the quantised mesh (see PrepareControlMesh): from
  // 1e-4 to 1.5e-3 the heights of an owl with 210 control points grew by 1 %, while its control
  // mesh fell by half. Rounded to 12 binary digits.
  double position_step = 0;
  // Binary digits that control points on the boundary have past the step: where the boundary is to
  // be exact it takes three bits for each of them, and the points inside take none. [0, 16].
  int border_digits = 0;
  // RMS distance of decoded and given heights, by area and without the filled ones, fraction of the
  // diagonal: the coarsest quantiser that keeps it is searched for. [1e-7, 0.1]. Errors of
  // different origin add up as squares: for a surface that is to be within E and is within e before
  // coding, ask for sqrt(E^2 - e^2).
  std::optional<double> max_error;
  // Bytes of the whole stream: the finest quantiser that keeps them is searched for. > 0. Not
  // together with max_error.
  std::optional<int64_t> max_bytes;
  // Standard error of the heights themselves, fraction of the diagonal, 0 when unknown. [0, 0.1].
  // No bytes are spent on an RMS error below half of it: together they err by 1.12 of it.
  double noise_floor = 0;
  // Filled heights in patches of fewer vertices of the finest level than this count as what is
  // around them: they lie between measured neighbours. So do patches of measured and of smoothed
  // heights; these are larger, up to 1024, where their flags would take more than a 32nd of the
  // file. 1 keeps all that flags of that size can tell. [1, 2^20].
  int smallest_hole = 16;
  // Heights of level 2 and on stand in groups of at most so many control faces, each of which
  // decodes by itself (DecodeRegion), where there are more faces than that. [128, 2^20]; 0: no
  // groups; -1: 1024 from 4096 control faces on, which takes 1 to 3 % more bytes.
  int group_faces = -1;
  // Heights on the border that are zero are zero in the file, for a few more bytes: no detail
  // beside the border takes part in them.
  bool keep_zero_border = false;
  absl::Status Validate() const;
};

// One direction of a measured distance, fractions of the diagonal; -1: unknown.
struct DssDistance {
  double rms = -1, mean = -1, p95 = -1, max = -1;
};

// What was known of the surface when it was made; travels in the header, all optional. Figures are
// kept to 11 binary digits.
struct DssMetadata {
  std::string generator;  // program and version
  double error_rms = -1;  // two-sided against the scan, fraction of the diagonal; -1: unknown
  double error_mean = -1;
  double error_p95 = -1;
  double error_max = -1;
  double error_across = -1;  // RMS across the surface: TwoSidedError::across_rms
  DssDistance surface_to_scan, scan_to_surface;
  double measured_share = -1, smoothed_share = -1,
         filled_share = -1;  // of the heights; -1: unknown
  int64_t folds = -1;        // triangles turned over
  int64_t scan_points = 0;
  std::string topology;    // "planar", "spherical", "arbitrary", "user"
  std::string input_hash;  // of the scan's bytes, at most 64 bytes
  std::string options;     // what the surface was asked for
  ScanPlace place;
  // Set by AddColors alone; not known: no colours.
  ColorCode colors;
  // Set by EncodeDss alone: every height that is not filled is smoothed; lifting rules of the
  // finest levels, coarse first, that have no coefficients and no chunk.
  bool all_smoothed = false;
  std::vector<uint8_t> plain_levels;
};

// Chunk 0 is header + control mesh; chunk 1 + l the heights that level l adds (the finest levels
// may have none, see DssMetadata::plain_levels), with their colours behind them; the last may tell
// which heights are smoothed.
// Their concatenation is the file, and any prefix of whole chunks decodes, to a surface with fewer
// levels.
struct EncodedSurface {
  std::vector<std::vector<uint8_t>> chunks;
  double height_step = 0;  // of the quantiser, as asked for or found
  double height_rms = 0;   // decoded against given heights, by area, without the filled ones
  double height_max = 0;
  std::vector<uint8_t> Concatenate() const;
};

// Nothing of the control mesh is lost, so it must be as PrepareControlMesh (prepare_control_mesh.h)
// makes it with this position_step: INVALID_ARGUMENT when its order is another, when a control
// point is off the grid, when a height is not finite or beyond 0.5 + 2^20 steps, or when the number
// of heights does not fit. RESOURCE_EXHAUSTED when max_bytes is too small for the control mesh and
// the coarsest heights. Small patches of
// one source come back as what is around them (see smallest_hole).
absl::StatusOr<EncodedSurface> EncodeDss(const DisplacedSurface& surface,
                                         const DssMetadata& metadata, const EncodeOptions& options,
                                         const RunContext& context);

// Puts other metadata into chunk 0, for figures that are known only once the bytes are decoded.
// INVALID_ARGUMENT for chunks that EncodeDss has not made.
absl::Status ReplaceMetadata(const DssMetadata& metadata, EncodedSurface& encoded);

struct DecodedSurface {
  DisplacedSurface surface;
  DssMetadata metadata;
  int format_version = 0;
  // Of the whole file; surface.max_level is smaller when the last chunks are not there yet. When
  // chunk 0 came alone, the surface has level 0, all heights zero and kFilled.
  int declared_max_level = 0;
  std::vector<int64_t> chunk_bytes;  // a chunk of colours counts to the one before it
  int64_t color_bytes = 0;           // of all chunks of colours
  // By which the last update of the file changed the heights; one a height, none without updates.
  std::vector<float> height_changes;
};

// DATA_LOSS for a truncated or corrupted stream (names the chunk), INVALID_ARGUMENT for what is no
// .dss at all, UNIMPLEMENTED for a newer version. Counts in the bytes are checked against the bytes
// that are there before anything is allocated (docs/dss-format.md states the law). A prefix that
// ends with a whole chunk is not an error.
absl::StatusOr<DecodedSurface> DecodeDss(std::span<const uint8_t> bytes, const RunContext& context);

// The same for chunk 0 alone, whatever comes after it.
absl::StatusOr<DecodedSurface> DecodeControlChunk(std::span<const uint8_t> bytes,
                                                  const RunContext& context);

}  // namespace rilievo
