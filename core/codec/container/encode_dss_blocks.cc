#include "core/codec/container/encode_dss_blocks.h"

#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/container/encode_file.h"
#include "core/codec/heights/encode_blocks.h"
#include "core/codec/heights/encode_smoothed_blocks.h"
#include "core/codec/heights/height_encoder_blocks.h"
#include "core/loop/refinement.h"

namespace rilievo {

namespace {

absl::StatusOr<DssDraft> DraftBlocks(const StoredSurface& surface, const PartCutter& cutter,
                                     const DssMetadata& metadata, const EncodeOptions& options) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  if (surface.max_level < kFirstGroupedLevel || surface.max_level > kMaxLoopLevel) {
    return absl::InvalidArgumentError(absl::StrCat("max_level is ", surface.max_level, ", must be ",
                                                   kFirstGroupedLevel, " to ", kMaxLoopLevel,
                                                   " where heights stand in groups"));
  }
  RILIEVO_ASSIGN_OR_RETURN(DssDraft draft,
                           DraftDss(surface.frame, surface.control_mesh, cutter.topology(),
                                    surface.max_level, metadata, options));
  if (draft.header.group_limit == 0) {
    return absl::InvalidArgumentError(absl::StrCat("encode.group_faces is ", options.group_faces,
                                                   " for ", draft.control.face_count(),
                                                   " control faces: there are no groups"));
  }
  return draft;
}

}  // namespace

absl::StatusOr<EncodedSurface> EncodeDssBlocks(const StoredSurface& surface,
                                               const PartCutter& cutter,
                                               const DssMetadata& metadata,
                                               const EncodeOptions& options, int64_t block_vertices,
                                               const RunContext& context, GatherBytes gather) {
  RILIEVO_ASSIGN_OR_RETURN(const DssDraft draft, DraftBlocks(surface, cutter, metadata, options));
  const EncodeBlocks blocks(surface, cutter, draft.groups, block_vertices, std::move(gather));
  RILIEVO_ASSIGN_OR_RETURN(const std::unique_ptr<HeightEncoderBlocks> encoder,
                           HeightEncoderBlocks::Make(blocks, options.smallest_hole, context));
  const auto encode_smoothed = [&](size_t /*plain_levels*/, int64_t bytes, int64_t most) {
    return EncodeSmoothedBlocks(blocks, options.smallest_hole, bytes, most, context);
  };
  return FinishDss(draft, *encoder, encoder->has_filled(), encode_smoothed, options, context);
}

absl::Status HelpToEncodeDssBlocks(const StoredSurface& surface, const PartCutter& cutter,
                                   const EncodeOptions& options, int64_t block_vertices,
                                   const RunContext& context, GatherBytes gather) {
  RILIEVO_ASSIGN_OR_RETURN(const DssDraft draft, DraftBlocks(surface, cutter, {}, options));
  const EncodeBlocks blocks(surface, cutter, draft.groups, block_vertices, std::move(gather));
  RILIEVO_ASSIGN_OR_RETURN(const std::unique_ptr<HeightEncoderBlocks> encoder,
                           HeightEncoderBlocks::Make(blocks, options.smallest_hole, context));
  return EncodeHeights(*encoder, options, /*bytes_left=*/0, context).status();
}

}  // namespace rilievo
