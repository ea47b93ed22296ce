// What comes before the heights: the chunks of a file in order, its header and its control mesh.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/codec/bytes/chunk.h"
#include "core/codec/container/dss_header.h"
#include "core/codec/mesh/face_groups.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

struct OpenedDss {
  int version = 0;
  DssHeader header;
  ControlMesh mesh;
  MeshTopology topology;             // of the control mesh
  FaceGroups groups;                 // where header.group_limit > 0
  std::vector<Chunk> layers;         // of level 0, 1, ...; they are views of the caller's bytes
  std::optional<Chunk> smoothed;     // only if the heights of all levels are there
  std::vector<Chunk> updates;        // in order; only if the heights of all levels are there
  std::vector<Chunk> colors;         // of level 0, 1, ...; at most as many as the file has levels
  std::vector<int64_t> chunk_bytes;  // one of colours, or an update, counts to that before it
  std::vector<std::span<const uint8_t>> Payloads() const;
  // Whether all chunks of heights are there.
  bool whole() const { return static_cast<int>(layers.size()) == header.layer_count(); }
  // Levels with heights, those without a chunk among them once all chunks are there.
  int level_count() const {
    return whole() ? header.max_level + 1 : static_cast<int>(layers.size());
  }
  // Rules of the levels that have none; empty unless all chunks are there.
  std::span<const uint8_t> PlainLevels() const;
  std::optional<std::span<const uint8_t>> SmoothedPayload() const;
};

// What chunk 0 says before the control mesh, whose counts are not looked at yet. The errors of
// DecodeDss.
absl::StatusOr<DssHeader> ReadDssHeader(std::span<const uint8_t> bytes);

// The errors of DecodeDss. All counts are held against the bytes that are there. Checksums of the
// layers that stand in groups are looked at only if `check_groups`: their pieces have their own.
absl::StatusOr<OpenedDss> OpenDss(std::span<const uint8_t> bytes, bool check_groups);

// The quantiser's step at the finest level with coefficients, fraction of the diagonal; 0 where no
// level has any.
double HeightStepOf(const OpenedDss& file);

// DATA_LOSS when the layers' bytes are too few for their heights.
absl::Status CheckHeightLaw(const OpenedDss& file);

}  // namespace rilievo
