#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/byte_stream.h"
#include "core/codec/bytes/chunk.h"
#include "core/codec/bytes/decode_limits.h"
#include "core/codec/bytes/stored_step.h"
#include "core/codec/container/dss.h"
#include "core/codec/container/dss_header.h"
#include "core/codec/heights/edge_rules.h"
#include "core/codec/heights/encode_smoothed_flags.h"
#include "core/codec/heights/height_encoder.h"
#include "core/codec/heights/rate_control.h"
#include "core/codec/mesh/control_mesh_coder.h"
#include "core/codec/mesh/crease_coder.h"
#include "core/codec/mesh/face_groups.h"
#include "core/loop/refinement.h"

namespace rilievo {
namespace {

// Of the heights, where nothing else was asked for.
constexpr double kHeightStep = 2e-5;

double StepOf(const EncodeOptions& options) {
  return options.height_step > 0 ? options.height_step : kHeightStep;
}

// Faces of a group and of the smallest surface that has groups, where nothing else was asked for.
constexpr int kGroupFaces = 1024, kLeastGroupedFaces = 4096;

constexpr double kMaxStep = 0.01;
constexpr double kMaxHeight = 0.5, kMaxHeightSteps = 1 << 20;
// The RMS error on which bits are still spent, in standard errors of the heights.
constexpr double kNoiseShare = 0.5;
constexpr int64_t kLayerOverhead = 8;  // of a chunk's tag, length and checksum, at most
constexpr int64_t kLayerFrame = 6;     // the same, at least
constexpr int64_t kStepSlack = 20;     // by which the header grows when all is coded

absl::Status CheckStep(double step, const char* name) {
  if (step > 0 && step <= kMaxStep) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("encode.", name, " is ", step, ", must be in (0, ", kMaxStep, "]"));
}

absl::StatusOr<std::vector<GridPoint>> GridPoints(const ControlMesh& mesh, double step) {
  std::vector<GridPoint> points(mesh.vertices.cols());
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      const double coordinate = mesh.vertices(axis, v);
      const double steps = std::nearbyint(coordinate / step);
      if (!(std::abs(steps) <= kMaxCoordinate) || steps * step != coordinate) {
        return absl::InvalidArgumentError(
            absl::StrCat("coordinate ", axis, " of control point ", v, " is ", coordinate,
                         ", no multiple of position_step ", step, ": call PrepareControlMesh"));
      }
      points[v][axis] = static_cast<int32_t>(steps);
    }
  }
  return points;
}

absl::Status CheckHeights(const DisplacedSurface& surface, double step) {
  const double limit = kMaxHeight + kMaxHeightSteps * step;
  for (size_t v = 0; v < surface.heights.size(); ++v) {
    if (!(std::abs(surface.heights[v]) <= limit)) {
      return absl::InvalidArgumentError(
          absl::StrCat("height ", v, " is ", surface.heights[v], ", must be within ", limit));
    }
    if (surface.sources[v] > HeightSource::kFilled) {
      return absl::InvalidArgumentError(absl::StrCat(
          "source ", v, " is ", static_cast<int>(surface.sources[v]), ", must be 0 to 2"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckHeightCount(const DisplacedSurface& surface, const LoopRefinement& refinement) {
  const MeshTopology& last = refinement.levels.back();
  const int64_t expected =
      last.vertex_count + (surface.max_level > 0 ? int64_t{last.edge_count()} : 0);
  if (static_cast<int64_t>(surface.heights.size()) == expected &&
      surface.sources.size() == surface.heights.size()) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(
      absl::StrCat("level ", surface.max_level, " has ", expected, " vertices, but there are ",
                   surface.heights.size(), " heights and ", surface.sources.size(), " sources"));
}

void PadTo(int64_t size, std::vector<uint8_t>& payload) {
  if (static_cast<int64_t>(payload.size()) < size) payload.resize(size, 0);
}

absl::StatusOr<std::vector<uint8_t>> ControlChunk(const DssHeader& header,
                                                  std::span<const uint8_t> coded_mesh) {
  const std::vector<uint8_t> head = EncodeDssHeader(header);
  // The reader's own checks of the frame and the counts, as an error of the caller's.
  if (absl::Status status = DecodeDssHeader(head, kDssVersion).status(); !status.ok()) {
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
  return WrapChunk(kControlTag, payload, true);
}

// 0: none.
int GroupLimit(int face_count, const EncodeOptions& options) {
  if (options.group_faces > 0) return face_count > options.group_faces ? options.group_faces : 0;
  return options.group_faces < 0 && face_count >= kLeastGroupedFaces ? kGroupFaces : 0;
}

bool HasTags(const ControlMesh& mesh) { return !mesh.creases.empty() || !mesh.corners.empty(); }

DssHeader HeaderOf(const DisplacedSurface& surface, const MeshTopology& topology,
                   const DssMetadata& metadata, const EncodeOptions& options) {
  DssHeader header;
  header.vertex_count = topology.vertex_count;
  header.face_count = topology.face_count();
  header.has_boundary = topology.face_neighbors.minCoeff() < 0;
  header.max_level = surface.max_level;
  header.frame = surface.frame;
  header.position_step =
      StoredStep(options.position_step > 0 ? options.position_step : kPositionStep);
  header.height_unit = header.position_step;  // until the heights are coded
  header.metadata = metadata;
  header.metadata.all_smoothed = false;
  header.metadata.plain_levels.clear();
  header.metadata.colors = {};
  return header;
}

// Heights as the options ask for them. `bytes_left`: of max_bytes, after chunk 0.
absl::StatusOr<EncodedHeights> EncodeHeights(const HeightEncoder& encoder,
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
  if (floor > 0) return EncodeWithinError(encoder, floor, StepOf(options), context);
  return encoder.Encode(StepOf(options), context);
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

// As a decoder has them: levels without a chunk follow those before.
std::vector<uint8_t> FilledAsDecoded(const LoopRefinement& refinement, int max_level,
                                     size_t plain_levels, std::vector<uint8_t> filled) {
  for (int level = max_level + 1 - static_cast<int>(plain_levels); level <= max_level; ++level) {
    const MeshTopology& topology = refinement.levels[level - 1];
    for (int e = 0; e < topology.edge_count(); ++e) {
      const EdgeStencil stencil = StencilOfEdge(topology, e);
      filled[topology.vertex_count + e] =
          static_cast<uint8_t>(filled[stencil.ends[0]] & filled[stencil.ends[1]]);
    }
  }
  return filled;
}

void WrapLayers(const LoopRefinement& refinement, int max_level,
                std::vector<std::vector<uint8_t>>& layers, EncodedSurface& encoded) {
  int64_t bytes = 0;
  for (size_t level = 0; level < layers.size(); ++level) {
    // The last one answers for the levels that have none.
    const int reached = level + 1 == layers.size() ? max_level : static_cast<int>(level);
    PadTo(HeightBytesByLimit(refinement.vertex_count(reached)) - bytes, layers[level]);
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

absl::Status EncodeOptions::Validate() const {
  const auto refuse = [](const char* name, auto value, const char* range) {
    return absl::InvalidArgumentError(
        absl::StrCat("encode.", name, " is ", value, ", must be in ", range));
  };
  if (height_step != 0) RILIEVO_RETURN_IF_ERROR(CheckStep(height_step, "height_step"));
  if (position_step != 0) RILIEVO_RETURN_IF_ERROR(CheckStep(position_step, "position_step"));
  if (max_error && !(*max_error >= 1e-7 && *max_error <= 0.1)) {
    return refuse("max_error", *max_error, "[1e-7, 0.1]");
  }
  if (max_bytes && *max_bytes <= 0) return refuse("max_bytes", *max_bytes, "[1, inf)");
  if (max_error && max_bytes) {
    return absl::InvalidArgumentError("encode.max_error and encode.max_bytes exclude each other");
  }
  if (!(noise_floor >= 0 && noise_floor <= 0.1)) {
    return refuse("noise_floor", noise_floor, "[0, 0.1]");
  }
  if (group_faces != 0 && group_faces != -1 &&
      (group_faces < kLeastGroupLimit || group_faces > kMostGroupLimit)) {
    return refuse("group_faces", group_faces, "[128, 2^20], 0 or -1");
  }
  if (smallest_hole < 1 || smallest_hole > 1 << 20) {
    return refuse("smallest_hole", smallest_hole, "[1, 2^20]");
  }
  return absl::OkStatus();
}

std::vector<uint8_t> EncodedSurface::Concatenate() const {
  std::vector<uint8_t> bytes;
  for (const std::vector<uint8_t>& chunk : chunks) {
    bytes.insert(bytes.end(), chunk.begin(), chunk.end());
  }
  return bytes;
}

absl::StatusOr<EncodedSurface> EncodeDss(const DisplacedSurface& surface,
                                         const DssMetadata& metadata, const EncodeOptions& options,
                                         const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  if (surface.max_level < 0 || surface.max_level > kMaxLoopLevel) {
    return absl::InvalidArgumentError(
        absl::StrCat("max_level is ", surface.max_level, ", must be 0 to ", kMaxLoopLevel));
  }
  // The new vertices of the finest level are the edges of the one before.
  RILIEVO_ASSIGN_OR_RETURN(
      const LoopRefinement refinement,
      RefineTopology(surface.control_mesh, std::max(0, surface.max_level - 1), context));
  RILIEVO_RETURN_IF_ERROR(CheckHeightCount(surface, refinement));
  RILIEVO_RETURN_IF_ERROR(CheckHeights(surface, StepOf(options)));
  const MeshTopology& control = refinement.levels[0];
  DssHeader header = HeaderOf(surface, control, metadata, options);
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<GridPoint> points,
                           GridPoints(surface.control_mesh, header.position_step));
  RILIEVO_ASSIGN_OR_RETURN(std::vector<uint8_t> coded_mesh,
                           EncodeControlMesh(control, points, SeedBits(header.position_step)));
  FaceGroups groups;
  header.group_limit = GroupLimit(control.face_count(), options);
  if (header.group_limit > 0) groups = GroupFaces(control, points, header.group_limit);
  RILIEVO_ASSIGN_OR_RETURN(
      const std::unique_ptr<HeightEncoder> encoder,
      header.group_limit > 0
          ? HeightEncoder::MakeGrouped(surface, refinement, options.smallest_hole, groups, context)
          : std::make_unique<HeightEncoder>(surface, refinement, options.smallest_hole));
  header.has_filled = encoder->has_filled();
  header.has_creases = HasTags(surface.control_mesh);
  if (header.has_creases) {
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> tags,
                             EncodeCreases(surface.control_mesh, control, points));
    std::vector<uint8_t> both;
    ByteWriter writer(both);
    writer.Varint(tags.size());
    writer.Bytes(tags);
    writer.Bytes(coded_mesh);
    coded_mesh = std::move(both);
  }
  const auto encode_smoothed = [&](const std::vector<uint8_t>& filled, int64_t bytes,
                                   int64_t most) {
    return EncodeSmoothedFlags(surface, refinement, filled,
                               header.group_limit > 0 ? &groups : nullptr, options.smallest_hole,
                               bytes, most, context);
  };
  RILIEVO_ASSIGN_OR_RETURN(std::vector<uint8_t> chunk, ControlChunk(header, coded_mesh));
  EncodedFlags smoothed;
  int64_t bytes_left =
      options.max_bytes.value_or(0) - static_cast<int64_t>(chunk.size()) - kStepSlack;
  if (options.max_bytes) {
    if (bytes_left <= 0) {
      return absl::ResourceExhaustedError(
          absl::StrCat("the control mesh alone takes ", chunk.size(), " bytes, max_bytes is ",
                       *options.max_bytes, "; allow more, or take fewer control faces"));
    }
    RILIEVO_ASSIGN_OR_RETURN(
        smoothed, encode_smoothed(encoder->filled(), *options.max_bytes, bytes_left / 2));
    bytes_left -= static_cast<int64_t>(smoothed.chunk.size());
  }
  RILIEVO_ASSIGN_OR_RETURN(EncodedHeights heights,
                           EncodeHeights(*encoder, options, bytes_left, context));
  std::vector<uint8_t>& plain = header.metadata.plain_levels;
  if (header.group_limit == 0 && smoothed.chunk.empty()) {
    plain = TakePlainLevels(static_cast<int64_t>(chunk.size()), heights.layers);
  }
  if (!options.max_bytes) {
    const int64_t bytes = static_cast<int64_t>(chunk.size()) + heights.bytes();
    RILIEVO_ASSIGN_OR_RETURN(
        smoothed, encode_smoothed(FilledAsDecoded(refinement, surface.max_level, plain.size(),
                                                  encoder->filled()),
                                  bytes, bytes));
  }
  header.metadata.all_smoothed = smoothed.all;
  header.height_unit = heights.unit;
  EncodedSurface encoded;
  encoded.height_step = heights.step;
  encoded.height_rms = heights.rms;
  encoded.height_max = heights.max;
  RILIEVO_ASSIGN_OR_RETURN(chunk, ControlChunk(header, coded_mesh));
  encoded.chunks.push_back(std::move(chunk));
  WrapLayers(refinement, surface.max_level, heights.layers, encoded);
  if (!smoothed.chunk.empty()) encoded.chunks.push_back(std::move(smoothed.chunk));
  context.Report(Stage::kEncode, 1);
  return CheckSize(std::move(encoded), options);
}

absl::Status ReplaceMetadata(const DssMetadata& metadata, EncodedSurface& encoded) {
  if (encoded.chunks.empty()) return absl::InvalidArgumentError("there is no chunk 0");
  RILIEVO_ASSIGN_OR_RETURN(const ChunkList list, ListChunks(encoded.chunks[0]));
  ByteReader reader(list.chunks[0].payload);
  const std::span<const uint8_t> head = reader.Bytes(reader.Varint());
  if (!reader.ok() || list.version != kDssVersion) {
    return absl::InvalidArgumentError("chunk 0 is not as this version writes it");
  }
  RILIEVO_ASSIGN_OR_RETURN(DssHeader header, DecodeDssHeader(head, list.version));
  const DssMetadata before = std::exchange(header.metadata, metadata);
  header.metadata.all_smoothed = before.all_smoothed;
  header.metadata.plain_levels = before.plain_levels;
  if (!metadata.colors.is_known()) header.metadata.colors = before.colors;
  RILIEVO_ASSIGN_OR_RETURN(encoded.chunks[0],
                           ControlChunk(header, reader.Bytes(reader.remaining())));
  return absl::OkStatus();
}

}  // namespace rilievo
