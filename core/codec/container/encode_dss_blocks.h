// A surface that does not fit into memory, as a .dss file.
#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/container/dss.h"
#include "core/surface/stored_surface.h"

namespace rilievo {

// As EncodeDss: any decoder of groups reads the file, whose bytes are not quite those of EncodeDss.
// The surface has at least kFirstGroupedLevel levels, more control faces than options.group_faces,
// which is asked for, and heights that EncodeDss takes: else INVALID_ARGUMENT. `cutter`: of its
// control mesh. `block_vertices`: see EncodeBlocks; some 250 bytes a vertex and thread are in use,
// and the bytes of the file depend on it.
absl::StatusOr<EncodedSurface> EncodeDssBlocks(const StoredSurface& surface,
                                               const PartCutter& cutter,
                                               const DssMetadata& metadata,
                                               const EncodeOptions& options, int64_t block_vertices,
                                               const RunContext& context);

}  // namespace rilievo
