// A surface that does not fit into memory, as a .dss file.
#pragma once

#include <cstdint>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/container/dss.h"
#include "core/codec/heights/encode_blocks.h"
#include "core/surface/stored_surface.h"

namespace rilievo {

// As EncodeDss: any decoder of groups reads the file, whose bytes are not quite those of EncodeDss.
// The surface has at least kFirstGroupedLevel levels, more control faces than options.group_faces,
// which is asked for, and heights that EncodeDss takes: else INVALID_ARGUMENT. `cutter`: of its
// control mesh. `block_vertices`: see EncodeBlocks; some 250 bytes a vertex and thread are in use,
// and the bytes of the file depend on it. `gather`: who codes the blocks; empty: this process.
absl::StatusOr<EncodedSurface> EncodeDssBlocks(const StoredSurface& surface,
                                               const PartCutter& cutter,
                                               const DssMetadata& metadata,
                                               const EncodeOptions& options, int64_t block_vertices,
                                               const RunContext& context, GatherBytes gather = {});

// What another process does that shares `gather` with the one that calls EncodeDssBlocks(), with
// the same arguments but for the metadata: it takes part in coding the heights, to the end. The
// options have no max_bytes, for the metadata would count.
absl::Status HelpToEncodeDssBlocks(const StoredSurface& surface, const PartCutter& cutter,
                                   const EncodeOptions& options, int64_t block_vertices,
                                   const RunContext& context, GatherBytes gather);

}  // namespace rilievo
