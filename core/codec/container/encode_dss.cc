#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/byte_stream.h"
#include "core/codec/bytes/chunk.h"
#include "core/codec/container/dss.h"
#include "core/codec/container/dss_header.h"
#include "core/codec/container/encode_file.h"
#include "core/codec/heights/edge_rules.h"
#include "core/codec/heights/encode_smoothed_flags.h"
#include "core/codec/heights/height_encoder.h"
#include "core/codec/mesh/border_coder.h"
#include "core/codec/mesh/face_groups.h"
#include "core/loop/refinement.h"

namespace rilievo {
namespace {

constexpr double kMaxHeight = 0.5, kMaxHeightSteps = 1 << 20;
absl::Status CheckStep(double step, const char* name) {
  if (step > 0 && step <= kMaxStep) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("encode.", name, " is ", step, ", must be in (0, ", kMaxStep, "]"));
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

}  // namespace

absl::Status EncodeOptions::Validate() const {
  const auto refuse = [](const char* name, auto value, const char* range) {
    return absl::InvalidArgumentError(
        absl::StrCat("encode.", name, " is ", value, ", must be in ", range));
  };
  if (height_step != 0) RILIEVO_RETURN_IF_ERROR(CheckStep(height_step, "height_step"));
  if (position_step != 0) RILIEVO_RETURN_IF_ERROR(CheckStep(position_step, "position_step"));
  if (border_digits < 0 || border_digits > kMostBorderDigits) {
    return refuse("border_digits", border_digits, "[0, 16]");
  }
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
  RILIEVO_RETURN_IF_ERROR(CheckHeights(surface, FirstHeightStep(options)));
  RILIEVO_ASSIGN_OR_RETURN(const DssDraft draft,
                           DraftDss(surface.frame, surface.control_mesh, refinement.levels[0],
                                    surface.max_level, metadata, options));
  const FaceGroups* groups = draft.header.group_limit > 0 ? &draft.groups : nullptr;
  const HeightEncoder encoder(surface, refinement, options.smallest_hole, groups, nullptr,
                              options.keep_zero_border);
  const auto encode_smoothed = [&](size_t plain_levels, int64_t bytes, int64_t most) {
    return EncodeSmoothedFlags(
        surface, refinement,
        FilledAsDecoded(refinement, surface.max_level, plain_levels, encoder.filled()), groups,
        options.smallest_hole, bytes, most, context);
  };
  return FinishDss(draft, encoder, encoder.has_filled(), encode_smoothed, options, context);
}

absl::Status ReplaceMetadata(const DssMetadata& metadata, EncodedSurface& encoded) {
  if (encoded.chunks.empty()) return absl::InvalidArgumentError("there is no chunk 0");
  RILIEVO_ASSIGN_OR_RETURN(const ChunkList list, ListChunks(encoded.chunks[0]));
  ByteReader reader(list.chunks[0].payload);
  const std::span<const uint8_t> head = reader.Bytes(reader.Varint());
  if (!reader.ok() || list.version < 3) {
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
