#include "core/codec/container/open_dss.h"

#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/byte_stream.h"
#include "core/codec/bytes/decode_limits.h"
#include "core/codec/container/height_update.h"
#include "core/codec/heights/height_layout.h"
#include "core/codec/mesh/border_coder.h"
#include "core/codec/mesh/control_mesh_coder.h"
#include "core/codec/mesh/crease_coder.h"
#include "core/codec/mesh/group_coder.h"
#include "core/codec/mesh/quad_coder.h"

namespace rilievo {
namespace {

absl::Status CheckLaw(int64_t items, int64_t items_per_byte, const Chunk& chunk, const char* what) {
  if (BytesByLimit(items, items_per_byte) <= static_cast<int64_t>(chunk.payload.size())) {
    return absl::OkStatus();
  }
  return absl::DataLossError(absl::StrCat("a chunk of ", chunk.payload.size(), " bytes claims ",
                                          items, " ", what, ", at most ", items_per_byte,
                                          " a byte are possible"));
}

// Control points as multiples of the step; INVALID_ARGUMENT of a mesh that is not a manifold
// becomes DATA_LOSS.
absl::Status DecodeControl(std::span<const uint8_t> bytes, OpenedDss& file) {
  const DssHeader& header = file.header;
  ByteReader reader(bytes);
  std::span<const uint8_t> groups, tags, quads, digits;
  if (header.tells_groups) groups = reader.Bytes(reader.Varint());
  if (header.has_creases) tags = reader.Bytes(reader.Varint());
  if (header.has_quads) quads = reader.Bytes(reader.Varint());
  if (header.border_digits > 0) digits = reader.Bytes(reader.Varint());
  if (!reader.ok()) return absl::DataLossError("chunk 0 ends before its control mesh");
  bytes = reader.Bytes(reader.remaining());
  const int vertices = header.vertex_count, faces = header.face_count;
  RILIEVO_ASSIGN_OR_RETURN(GridMesh grid,
                           file.version == 1
                               ? DecodeControlMeshV1(bytes, vertices, faces, header.has_boundary)
                               : DecodeControlMesh(bytes, vertices, faces, header.has_boundary,
                                                   SeedBits(header.position_step)));
  absl::StatusOr<MeshTopology> topology = BuildMeshTopology(grid.faces, header.vertex_count);
  if (!topology.ok()) {
    return absl::DataLossError(
        absl::StrCat("the control mesh is not a manifold: ", topology.status().message()));
  }
  if ((topology->face_neighbors.minCoeff() < 0) != header.has_boundary) {
    return absl::DataLossError("the control mesh and its header disagree about a boundary");
  }
  ControlMesh& mesh = file.mesh;
  mesh.vertices.resize(3, header.vertex_count);
  for (int v = 0; v < header.vertex_count; ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      mesh.vertices(axis, v) = grid.points[v][axis] * header.position_step;
    }
  }
  mesh.faces = std::move(grid.faces);
  if (header.has_creases) {
    RILIEVO_RETURN_IF_ERROR(DecodeCreases(tags, *topology, grid.points, mesh));
  }
  if (header.border_digits > 0) {
    RILIEVO_RETURN_IF_ERROR(
        DecodeBorderDigits(digits, *topology, header.position_step, header.border_digits, mesh));
  }
  if (header.has_quads) {
    RILIEVO_RETURN_IF_ERROR(DecodeQuads(quads, *topology, grid.points, mesh));
  }
  file.topology = *std::move(topology);
  if (header.tells_groups) {
    RILIEVO_ASSIGN_OR_RETURN(file.groups, DecodeGroups(groups, file.topology, header.group_limit));
  } else if (header.group_limit > 0) {
    file.groups = GroupFaces(file.topology, grid.points, header.group_limit);
  }
  return absl::OkStatus();
}

// New vertices of level l, from the counts of the control mesh alone: an edge becomes two, a face
// brings three edges and three more faces.
std::vector<int64_t> NewVertexCounts(const MeshTopology& control, int level_count) {
  std::vector<int64_t> counts;
  int64_t edges = control.edge_count(), faces = control.face_count();
  for (int level = 0; level < level_count; ++level) {
    if (level == 0) {
      counts.push_back(control.vertex_count);
      continue;
    }
    counts.push_back(edges);
    edges = 2 * edges + 3 * faces;
    faces *= 4;
  }
  return counts;
}

// Chunk 0 and the layers in order. Chunks that may be skipped are, once their checksum says that
// they are such chunks.
absl::Status SortChunks(const ChunkList& list, bool checked, Chunk& control, OpenedDss& file) {
  for (size_t i = 0; i < list.chunks.size(); ++i) {
    const Chunk& chunk = list.chunks[i];
    if (chunk.tag == kSmoothedTag && list.version > 2 && i > 0) {
      if (!file.smoothed) file.smoothed = chunk;
      continue;
    }
    if (chunk.tag >= 'a' && chunk.tag <= 'z' && i > 0) {
      if (!checked) RILIEVO_RETURN_IF_ERROR(CheckChunk(chunk));
      if (chunk.tag == kColorsTag && list.version > 2) file.colors.push_back(chunk);
      continue;
    }
    if ((chunk.tag == kControlTag) != (i == 0)) {
      return absl::DataLossError(absl::StrCat("the control mesh is not chunk 0 but chunk ", i));
    }
    if (i == 0) {
      control = chunk;
    } else if (chunk.tag == kHeightsTag) {
      file.layers.push_back(chunk);
    } else if (chunk.tag == kUpdateTag && list.version > 2) {
      if (!checked) RILIEVO_RETURN_IF_ERROR(CheckChunk(chunk));
      file.updates.push_back(chunk);
    } else {
      return absl::UnimplementedError(
          absl::StrCat("chunk ", i, " is of a kind this decoder must know and does not, ",
                       static_cast<int>(chunk.tag)));
    }
  }
  return absl::OkStatus();
}

// They change the heights of all levels.
absl::Status CheckUpdates(const OpenedDss& file) {
  if (file.updates.empty()) return absl::OkStatus();
  if (file.updates.size() > kMostUpdates) {
    return absl::DataLossError(absl::StrCat("there are ", file.updates.size(),
                                            " updates, the format ends at ", kMostUpdates));
  }
  if (file.whole() && file.updates.front().number > file.layers.back().number) {
    return absl::OkStatus();
  }
  return absl::DataLossError(absl::StrCat("chunk ", file.updates.front().number,
                                          " updates heights that are not all there yet"));
}

}  // namespace

std::vector<std::span<const uint8_t>> OpenedDss::Payloads() const {
  std::vector<std::span<const uint8_t>> payloads;
  for (const Chunk& layer : layers) payloads.push_back(layer.payload);
  return payloads;
}

std::optional<std::span<const uint8_t>> OpenedDss::SmoothedPayload() const {
  if (!smoothed) return std::nullopt;
  return smoothed->payload;
}

std::span<const uint8_t> OpenedDss::PlainLevels() const {
  if (!whole()) return {};
  return header.metadata.plain_levels;
}

double HeightStepOf(const OpenedDss& file) {
  if (file.version == 1) return file.header.height_unit;
  double step = 0;
  for (const Chunk& layer : file.layers) {
    ByteReader reader(layer.payload);
    if ((reader.Byte() & kEmptyLayerFlag) != 0) continue;
    step = static_cast<double>(reader.Varint()) * file.header.height_unit;
  }
  return step;
}

absl::Status CheckHeightLaw(const OpenedDss& file) {
  const std::vector<int64_t> counts = NewVertexCounts(file.topology, file.level_count());
  int64_t bytes = 0, vertices = 0;
  for (size_t level = 0; level < counts.size(); ++level) {
    if (level < file.layers.size()) {
      bytes += static_cast<int64_t>(file.layers[level].payload.size());
    }
    vertices += counts[level];
    if (file.version == 1) {
      RILIEVO_RETURN_IF_ERROR(
          CheckLaw(counts[level], kHeightsPerByte, file.layers[level], "heights"));
    } else if (HeightBytesByLimit(vertices) > bytes) {
      return absl::DataLossError(absl::StrCat("layers of ", bytes, " bytes claim ", vertices,
                                              " heights, at most ", kFreeHeights, " and ",
                                              kHeightsPerByte, " a byte are possible"));
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<DssHeader> ReadDssHeader(std::span<const uint8_t> bytes) {
  RILIEVO_ASSIGN_OR_RETURN(const ChunkList list, ListChunks(bytes, false));
  if (list.chunks.empty() || list.chunks[0].tag != kControlTag) {
    return absl::DataLossError("the file does not begin with a control mesh");
  }
  ByteReader reader(list.chunks[0].payload);
  const std::span<const uint8_t> head = reader.Bytes(reader.Varint());
  if (!reader.ok()) return absl::DataLossError("chunk 0 ends within its header");
  return DecodeDssHeader(head, list.version);
}

absl::StatusOr<OpenedDss> OpenDss(std::span<const uint8_t> bytes, bool check_groups) {
  RILIEVO_ASSIGN_OR_RETURN(const ChunkList list, ListChunks(bytes, check_groups));
  OpenedDss file;
  file.version = list.version;
  Chunk control;
  RILIEVO_RETURN_IF_ERROR(SortChunks(list, check_groups, control, file));
  if (!check_groups) RILIEVO_RETURN_IF_ERROR(CheckChunk(control));
  ByteReader reader(control.payload);
  const std::span<const uint8_t> head = reader.Bytes(reader.Varint());
  if (!reader.ok()) return absl::DataLossError("chunk 0 ends within its header");
  RILIEVO_ASSIGN_OR_RETURN(file.header, DecodeDssHeader(head, list.version));
  const DssHeader& header = file.header;
  if (static_cast<int>(file.layers.size()) > header.layer_count()) {
    return absl::DataLossError(absl::StrCat("there are ", file.layers.size(),
                                            " height layers, max_level ", header.max_level, " has ",
                                            header.layer_count()));
  }
  const size_t apart = header.group_limit > 0 ? kFirstGroupedLevel : file.layers.size();
  for (size_t level = 0; !check_groups && level < file.layers.size() && level < apart; ++level) {
    RILIEVO_RETURN_IF_ERROR(CheckChunk(file.layers[level]));
  }
  if (static_cast<int>(file.colors.size()) > header.max_level + 1) {
    return absl::DataLossError(absl::StrCat("there are ", file.colors.size(),
                                            " levels of colours, max_level is ", header.max_level));
  }
  RILIEVO_RETURN_IF_ERROR(CheckUpdates(file));
  if (file.smoothed && (!file.whole() || file.smoothed->number < file.layers.back().number)) {
    file.smoothed.reset();
  }
  if (file.smoothed && !check_groups && apart == file.layers.size()) {
    RILIEVO_RETURN_IF_ERROR(CheckChunk(*file.smoothed));
  }
  RILIEVO_RETURN_IF_ERROR(
      CheckLaw(header.vertex_count, kControlVerticesPerByte, control, "control vertices"));
  RILIEVO_RETURN_IF_ERROR(
      CheckLaw(header.face_count, kControlFacesPerByte, control, "control faces"));
  RILIEVO_RETURN_IF_ERROR(DecodeControl(reader.Bytes(reader.remaining()), file));
  for (const Chunk& chunk : list.chunks) {
    if (chunk.tag == kColorsTag || chunk.tag == kUpdateTag) {
      file.chunk_bytes.back() += chunk.bytes;
    } else {
      file.chunk_bytes.push_back(chunk.bytes);
    }
  }
  return file;
}

}  // namespace rilievo
