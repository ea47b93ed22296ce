#include "core/codec/container/encode_file.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/byte_stream.h"
#include "core/codec/bytes/chunk.h"
#include "core/codec/bytes/decode_limits.h"
#include "core/codec/bytes/stored_step.h"
#include "core/codec/heights/rate_control.h"
#include "core/codec/mesh/border_coder.h"
#include "core/codec/mesh/control_mesh_coder.h"
#include "core/codec/mesh/crease_coder.h"
#include "core/codec/mesh/quad_coder.h"
#include "core/surface/stored_surface.h"

namespace rilievo {
namespace {

// Of the heights, where nothing else was asked for.
constexpr double kHeightStep = 2e-5;

// Faces of a group and of the smallest surface that has groups, where nothing else was asked for.
constexpr int kGroupFaces = 1024, kLeastGroupedFaces = 4096;

// The RMS error on which bits are still spent, in standard errors of the heights.
constexpr double kNoiseShare = 0.5;
constexpr int64_t kLayerOverhead = 8;  // of a chunk's tag, length and checksum, at most
constexpr int64_t kLayerFrame = 6;     // the same, at least
constexpr int64_t kStepSlack = 20;     // by which the header grows when all is coded

struct GridPoints {
  std::vector<GridPoint> coarse, past;  // see EncodeBorderDigits()
};

absl::StatusOr<GridPoints> SplitPoints(const ControlMesh& mesh, const MeshTopology& topology,
                                       double step, int border_digits) {
  GridPoints points;
  points.coarse.resize(mesh.vertices.cols());
  points.past.resize(mesh.vertices.cols());
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const int digits = topology.boundary_vertex[v] != 0 ? border_digits : 0;
    const double fine = BorderStep(step, digits), half = std::ldexp(0.5, digits);
    for (int axis = 0; axis < 3; ++axis) {
      const double coordinate = mesh.vertices(axis, v);
      const double steps = std::nearbyint(coordinate / fine);
      const double coarse = std::floor(std::ldexp(steps + half, -digits));
      if (!(std::abs(coarse) <= kMaxCoordinate) || steps * fine != coordinate) {
        return absl::InvalidArgumentError(
            absl::StrCat("coordinate ", axis, " of control point ", v, " is ", coordinate,
                         ", no multiple of position_step ", fine, ": call PrepareControlMesh"));
      }
      points.coarse[v][axis] = static_cast<int32_t>(coarse);
      points.past[v][axis] = static_cast<int32_t>(steps - std::ldexp(coarse, digits));
    }
  }
  return points;
}

void PadTo(int64_t size, std::vector<uint8_t>& payload) {
  if (static_cast<int64_t>(payload.size()) < size) payload.resize(size, 0);
}

// 0: none.
int GroupLimit(int face_count, const EncodeOptions& options) {
  if (options.group_faces > 0) return face_count > options.group_faces ? options.group_faces : 0;
  return options.group_faces < 0 && face_count >= kLeastGroupedFaces ? kGroupFaces : 0;
}

bool HasTags(const ControlMesh& mesh) { return !mesh.creases.empty() || !mesh.corners.empty(); }

DssHeader HeaderOf(const SpatialFrame& frame, const MeshTopology& topology, int max_level,
                   const DssMetadata& metadata, const EncodeOptions& options) {
  DssHeader header;
  header.vertex_count = topology.vertex_count;
  header.face_count = topology.face_count();
  header.has_boundary = topology.face_neighbors.minCoeff() < 0;
  header.max_level = max_level;
  header.frame = frame;
  header.position_step =
      StoredStep(options.position_step > 0 ? options.position_step : kPositionStep);
  header.height_unit = header.position_step;  // until the heights are coded
  header.metadata = metadata;
  header.metadata.all_smoothed = false;
  header.metadata.plain_levels.clear();
  header.metadata.colors = {};
  return header;
}

// `part` with its length, before what is coded already.
void PutBefore(const std::vector<uint8_t>& part, std::vector<uint8_t>& coded) {
  std::vector<uint8_t> both;
  ByteWriter writer(both);
  writer.Varint(part.size());
  writer.Bytes(part);
  writer.Bytes(coded);
  coded = std::move(both);
}

bool IsEmpty(const std::vector<uint8_t>& layer) { return (layer[0] & kEmptyLayerFlag) != 0; }

// Takes off the finest layers that hold no coefficients, and gives their rules. They may hold flags
// of filled heights, which are as coarse then as the heights that are told: only where that saves
// something worth it of a file of `other_bytes` besides.
std::vector<uint8_t> TakePlainLevels(int64_t other_bytes,
                                     std::vector<std::vector<uint8_t>>& layers) {
  constexpr int64_t kWorth = 64;  // as one part in so many
  size_t left = layers.size();
  int64_t saved = 0, all = other_bytes;
  for (const auto& layer : layers) all += static_cast<int64_t>(layer.size());
  for (; left > 1 && IsEmpty(layers[left - 1]); --left) {
    saved += static_cast<int64_t>(layers[left - 1].size()) + kLayerFrame;
  }
  std::vector<uint8_t> rules;
  if (saved * kWorth < all) return rules;
  for (size_t level = left; level < layers.size(); ++level) {
    rules.push_back(static_cast<uint8_t>((layers[level][0] & ~kEmptyLayerFlag) >> 4));
  }
  layers.resize(left);
  return rules;
}

void WrapLayers(const MeshTopology& control, int max_level,
                std::vector<std::vector<uint8_t>>& layers, EncodedSurface& encoded) {
  int64_t bytes = 0;
  for (size_t level = 0; level < layers.size(); ++level) {
    // The last one answers for the levels that have none.
    const int reached = level + 1 == layers.size() ? max_level : static_cast<int>(level);
    PadTo(HeightBytesByLimit(VertexCountAt(control, reached)) - bytes, layers[level]);
    bytes += static_cast<int64_t>(layers[level].size());
    encoded.chunks.push_back(WrapChunk(kHeightsTag, layers[level], false));
  }
}

absl::StatusOr<EncodedSurface> CheckSize(EncodedSurface encoded, const EncodeOptions& options) {
  int64_t bytes = 0;
  for (const auto& chunk : encoded.chunks) bytes += static_cast<int64_t>(chunk.size());
  if (!options.max_bytes || bytes <= *options.max_bytes) return encoded;
  return absl::ResourceExhaustedError(absl::StrCat("the coarsest stream takes ", bytes,
                                                   " bytes, max_bytes is ", *options.max_bytes));
}

}  // namespace

double FirstHeightStep(const EncodeOptions& options) {
  return options.height_step > 0 ? options.height_step : kHeightStep;
}

absl::StatusOr<std::vector<uint8_t>> ControlChunk(const DssHeader& header,
                                                  std::span<const uint8_t> coded_mesh) {
  const std::vector<uint8_t> head = EncodeDssHeader(header);
  // The reader's own checks of the frame and the counts, as an error of the caller's.
  if (absl::Status status = DecodeDssHeader(head, VersionOf(header)).status(); !status.ok()) {
    return absl::InvalidArgumentError(status.message());
  }
  std::vector<uint8_t> payload;
  ByteWriter writer(payload);
  writer.Varint(head.size());
  writer.Bytes(head);
  writer.Bytes(coded_mesh);
  PadTo(std::max(BytesByLimit(header.vertex_count, kControlVerticesPerByte),
                 BytesByLimit(header.face_count, kControlFacesPerByte)),
        payload);
  return WrapChunk(kControlTag, payload, true, VersionOf(header));
}

absl::StatusOr<DssDraft> DraftDss(const SpatialFrame& frame, const ControlMesh& mesh,
                                  const MeshTopology& control, int max_level,
                                  const DssMetadata& metadata, const EncodeOptions& options) {
  DssDraft draft;
  draft.control = control;
  DssHeader& header = draft.header;
  header = HeaderOf(frame, control, max_level, metadata, options);
  header.border_digits = header.has_boundary ? options.border_digits : 0;
  RILIEVO_ASSIGN_OR_RETURN(const GridPoints split,
                           SplitPoints(mesh, control, header.position_step, header.border_digits));
  const std::vector<GridPoint>& points = split.coarse;
  RILIEVO_ASSIGN_OR_RETURN(draft.coded_mesh,
                           EncodeControlMesh(control, points, SeedBits(header.position_step)));
  if (header.border_digits > 0) {
    PutBefore(EncodeBorderDigits(split.past, control, header.border_digits), draft.coded_mesh);
  }
  header.group_limit = GroupLimit(control.face_count(), options);
  if (header.group_limit > 0) draft.groups = GroupFaces(control, points, header.group_limit);
  header.has_quads = mesh.quads();
  if (header.has_quads) {
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> quads, EncodeQuads(mesh, control, points));
    PutBefore(quads, draft.coded_mesh);
  }
  header.has_creases = HasTags(mesh);
  if (header.has_creases) {
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> tags, EncodeCreases(mesh, control, points));
    PutBefore(tags, draft.coded_mesh);
  }
  return draft;
}

absl::StatusOr<EncodedHeights> EncodeHeights(const HeightCoding& encoder,
                                             const EncodeOptions& options, int64_t bytes_left,
                                             const RunContext& context) {
  const double floor = kNoiseShare * options.noise_floor;
  if (options.max_error) {
    return EncodeWithinError(encoder, std::max(*options.max_error, floor), 0, context);
  }
  if (options.max_bytes) {
    double least_step = 0;
    if (floor > 0) {
      RILIEVO_ASSIGN_OR_RETURN(const EncodedHeights finest,
                               EncodeWithinError(encoder, floor, 0, context));
      least_step = finest.step;
    }
    return EncodeWithinBytes(encoder, bytes_left, kLayerOverhead, least_step, context);
  }
  if (floor > 0) return EncodeWithinError(encoder, floor, FirstHeightStep(options), context);
  return encoder.Encode(FirstHeightStep(options), context);
}

absl::StatusOr<EncodedSurface> FinishDss(const DssDraft& draft, const HeightCoding& coding,
                                         bool has_filled, const SmoothedCoding& encode_smoothed,
                                         const EncodeOptions& options, const RunContext& context) {
  DssHeader header = draft.header;
  header.has_filled = has_filled;
  RILIEVO_ASSIGN_OR_RETURN(std::vector<uint8_t> chunk, ControlChunk(header, draft.coded_mesh));
  EncodedFlags smoothed;
  int64_t bytes_left =
      options.max_bytes.value_or(0) - static_cast<int64_t>(chunk.size()) - kStepSlack;
  if (options.max_bytes) {
    if (bytes_left <= 0) {
      return absl::ResourceExhaustedError(
          absl::StrCat("the control mesh alone takes ", chunk.size(), " bytes, max_bytes is ",
                       *options.max_bytes, "; allow more, or take fewer control faces"));
    }
    RILIEVO_ASSIGN_OR_RETURN(smoothed, encode_smoothed(0, *options.max_bytes, bytes_left / 2));
    bytes_left -= static_cast<int64_t>(smoothed.chunk.size());
  }
  RILIEVO_ASSIGN_OR_RETURN(EncodedHeights heights,
                           EncodeHeights(coding, options, bytes_left, context));
  std::vector<uint8_t>& plain = header.metadata.plain_levels;
  if (header.group_limit == 0 && smoothed.chunk.empty()) {
    plain = TakePlainLevels(static_cast<int64_t>(chunk.size()), heights.layers);
  }
  if (!options.max_bytes) {
    const int64_t bytes = static_cast<int64_t>(chunk.size()) + heights.bytes();
    RILIEVO_ASSIGN_OR_RETURN(smoothed, encode_smoothed(plain.size(), bytes, bytes));
  }
  header.metadata.all_smoothed = smoothed.all;
  header.height_unit = heights.unit;
  EncodedSurface encoded;
  encoded.height_step = heights.step;
  encoded.height_rms = heights.rms;
  encoded.height_max = heights.max;
  RILIEVO_ASSIGN_OR_RETURN(chunk, ControlChunk(header, draft.coded_mesh));
  encoded.chunks.push_back(std::move(chunk));
  WrapLayers(draft.control, header.max_level, heights.layers, encoded);
  if (!smoothed.chunk.empty()) encoded.chunks.push_back(std::move(smoothed.chunk));
  context.Report(Stage::kEncode, 1);
  return CheckSize(std::move(encoded), options);
}

}  // namespace rilievo
