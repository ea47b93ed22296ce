#include <algorithm>
#include <utility>

#include "absl/status/status.h"
#include "core/base/status_macros.h"
#include "core/codec/container/colors.h"
#include "core/codec/container/dss.h"
#include "core/codec/container/height_update.h"
#include "core/codec/container/open_dss.h"
#include "core/codec/heights/height_decoder.h"
#include "core/codec/heights/height_layer.h"
#include "core/loop/refinement.h"

namespace rilievo {
namespace {

absl::Status DecodeHeightsV1(const std::vector<Chunk>& layers, const LoopRefinement& refinement,
                             double step, const RunContext& context, DisplacedSurface& surface) {
  GridHeights field;
  for (int level = 0; level < static_cast<int>(layers.size()); ++level) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    RILIEVO_RETURN_IF_ERROR(DecodeHeightLayer(
        layers[level].payload, refinement.levels[std::max(0, level - 1)], level == 0, field));
  }
  for (int32_t steps : field.heights) surface.heights.push_back(static_cast<float>(steps * step));
  surface.sources = std::move(field.sources);
  return absl::OkStatus();
}

absl::Status DecodeHeights(const OpenedDss& file, const RunContext& context,
                           DecodedSurface& whole) {
  DisplacedSurface& surface = whole.surface;
  const int level_count = file.level_count();
  RILIEVO_RETURN_IF_ERROR(CheckHeightLaw(file));
  RILIEVO_ASSIGN_OR_RETURN(
      const LoopRefinement refinement,
      RefineTopology(surface.control_mesh, std::max(0, level_count - 2), context));
  surface.max_level = level_count - 1;
  const DssHeader& header = file.header;
  if (file.version == 1) {
    return DecodeHeightsV1(file.layers, refinement, header.height_unit, context, surface);
  }
  RILIEVO_ASSIGN_OR_RETURN(const DecodedHeights decoded,
                           DecodeHeightLayers(file.Payloads(), file.PlainLevels(), refinement,
                                              header.group_limit > 0 ? &file.groups : nullptr,
                                              header.has_filled, file.SmoothedPayload(), context));
  surface.heights.reserve(decoded.heights.size());
  for (int32_t height : decoded.heights) {
    surface.heights.push_back(static_cast<float>(height * header.height_unit));
  }
  surface.sources = decoded.Sources(header.metadata.all_smoothed);
  RILIEVO_ASSIGN_OR_RETURN(whole.height_changes, ApplyUpdates(file, refinement, context,
                                                              &surface.heights, &surface.sources));
  RILIEVO_ASSIGN_OR_RETURN(surface.colors, DecodeColors(file, refinement, context));
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<DecodedSurface> DecodeDss(std::span<const uint8_t> bytes,
                                         const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(OpenedDss file, OpenDss(bytes, true));
  DecodedSurface decoded;
  decoded.surface.frame = file.header.frame;
  decoded.surface.control_mesh = std::move(file.mesh);
  if (file.layers.empty()) {
    decoded.surface.heights.assign(file.header.vertex_count, 0.0f);
    decoded.surface.sources.assign(file.header.vertex_count, HeightSource::kFilled);
  } else {
    RILIEVO_RETURN_IF_ERROR(DecodeHeights(file, context, decoded));
  }
  RILIEVO_ASSIGN_OR_RETURN(decoded.metadata, MetadataWithUpdates(file));
  decoded.format_version = file.version;
  decoded.declared_max_level = file.header.max_level;
  decoded.chunk_bytes = std::move(file.chunk_bytes);
  for (const Chunk& chunk : file.colors) decoded.color_bytes += chunk.bytes;
  return decoded;
}

absl::StatusOr<DecodedSurface> DecodeControlChunk(std::span<const uint8_t> bytes,
                                                  const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const ChunkList list, ListChunks(bytes, false));
  return DecodeDss(bytes.first(static_cast<size_t>(list.chunks.front().bytes)), context);
}

}  // namespace rilievo
