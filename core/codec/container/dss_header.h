// The fixed part of chunk 0 of a .dss file: frame, counts, quantiser steps, metadata.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/codec/container/dss.h"
#include "core/geometry/spatial_frame.h"

namespace rilievo {

struct DssHeader {
  int vertex_count = 0;  // of the control mesh
  int face_count = 0;
  bool has_boundary = false;
  int max_level = 0;
  SpatialFrame frame;
  double position_step = 0;  // fraction of the diagonal
  double height_unit = 0;    // of the heights as integers, same; version 1: the quantiser's step
  bool has_filled = false;   // whether any height counts as filled in; version 1: true
  bool has_creases = false;
  int group_limit = 0;  // most faces of a group (face_groups.h); 0: no groups
  // Whether the file tells its groups (group_coder.h); else they follow from the control points.
  bool tells_groups = false;
  // Binary digits that control points on the boundary have past position_step (border_coder.h).
  int border_digits = 0;
  bool has_quads = false;  // whether the surface is a Catmull-Clark surface (quad_coder.h)
  DssMetadata metadata;

  // Chunks of heights in a whole file.
  int layer_count() const { return max_level + 1 - static_cast<int>(metadata.plain_levels.size()); }
};

// The oldest version that has what such a file holds.
int VersionOf(const DssHeader& header);

// Of VersionOf().
std::vector<uint8_t> EncodeDssHeader(const DssHeader& header);

// DATA_LOSS when a field is missing or out of range. The counts are checked for themselves here,
// and against the chunk's size by the caller.
absl::StatusOr<DssHeader> DecodeDssHeader(std::span<const uint8_t> bytes, int version);

}  // namespace rilievo
