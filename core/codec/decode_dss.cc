#include <algorithm>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/byte_stream.h"
#include "core/codec/chunk.h"
#include "core/codec/control_mesh_coder.h"
#include "core/codec/crease_coder.h"
#include "core/codec/decode_law.h"
#include "core/codec/dss.h"
#include "core/codec/dss_header.h"
#include "core/codec/height_decoder.h"
#include "core/codec/height_layer.h"
#include "core/loop/refinement.h"

namespace rilievo {
namespace {

absl::Status CheckLaw(int64_t items, int64_t items_per_byte, const Chunk& chunk, const char* what) {
  if (BytesByLaw(items, items_per_byte) <= static_cast<int64_t>(chunk.payload.size())) {
    return absl::OkStatus();
  }
  return absl::DataLossError(absl::StrCat("a chunk of ", chunk.payload.size(), " bytes claims ",
                                          items, " ", what, ", at most ", items_per_byte,
                                          " a byte are possible"));
}

// Control points as multiples of the step; INVALID_ARGUMENT of a mesh that is no manifold becomes
// DATA_LOSS.
absl::StatusOr<std::pair<ControlMesh, MeshTopology>> DecodeControl(std::span<const uint8_t> bytes,
                                                                   const DssHeader& header,
                                                                   int version) {
  std::span<const uint8_t> tags;
  if (header.has_creases) {
    ByteReader reader(bytes);
    tags = reader.Bytes(reader.Varint());
    if (!reader.ok()) return absl::DataLossError("chunk 0 ends within its crease tags");
    bytes = reader.Bytes(reader.remaining());
  }
  const int vertices = header.vertex_count, faces = header.face_count;
  RILIEVO_ASSIGN_OR_RETURN(
      GridMesh grid, version == 1 ? DecodeControlMeshV1(bytes, vertices, faces, header.has_boundary)
                                  : DecodeControlMesh(bytes, vertices, faces, header.has_boundary,
                                                      SeedBits(header.position_step)));
  absl::StatusOr<MeshTopology> topology = BuildMeshTopology(grid.faces, header.vertex_count);
  if (!topology.ok()) {
    return absl::DataLossError(
        absl::StrCat("the control mesh is no manifold: ", topology.status().message()));
  }
  if ((topology->face_neighbors.minCoeff() < 0) != header.has_boundary) {
    return absl::DataLossError("the control mesh and its header disagree about a boundary");
  }
  ControlMesh mesh;
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
  return std::make_pair(std::move(mesh), *std::move(topology));
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

absl::Status CheckHeightLaw(const std::vector<Chunk>& layers, const std::vector<int64_t>& counts,
                            int version) {
  int64_t bytes = 0, vertices = 0;
  for (size_t level = 0; level < layers.size(); ++level) {
    bytes += static_cast<int64_t>(layers[level].payload.size());
    vertices += counts[level];
    if (version == 1) {
      RILIEVO_RETURN_IF_ERROR(CheckLaw(counts[level], kHeightsPerByte, layers[level], "heights"));
    } else if (HeightBytesByLaw(vertices) > bytes) {
      return absl::DataLossError(absl::StrCat("layers of ", bytes, " bytes claim ", vertices,
                                              " heights, at most ", kFreeHeights, " and ",
                                              kHeightsPerByte, " a byte are possible"));
    }
  }
  return absl::OkStatus();
}

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

absl::Status DecodeHeights(const std::vector<Chunk>& layers, const MeshTopology& control,
                           const DssHeader& header, int version, const RunContext& context,
                           DisplacedSurface& surface) {
  const int level_count = static_cast<int>(layers.size());
  RILIEVO_RETURN_IF_ERROR(CheckHeightLaw(layers, NewVertexCounts(control, level_count), version));
  RILIEVO_ASSIGN_OR_RETURN(
      const LoopRefinement refinement,
      RefineTopology(surface.control_mesh, std::max(0, level_count - 2), context));
  surface.max_level = level_count - 1;
  if (version == 1) {
    return DecodeHeightsV1(layers, refinement, header.height_unit, context, surface);
  }
  std::vector<std::span<const uint8_t>> payloads;
  for (const Chunk& layer : layers) payloads.push_back(layer.payload);
  RILIEVO_ASSIGN_OR_RETURN(const DecodedHeights decoded,
                           DecodeHeightLayers(payloads, refinement, header.has_filled, context));
  surface.heights.reserve(decoded.heights.size());
  surface.sources.reserve(decoded.heights.size());
  for (size_t v = 0; v < decoded.heights.size(); ++v) {
    surface.heights.push_back(static_cast<float>(decoded.heights[v] * header.height_unit));
    surface.sources.push_back(decoded.filled[v] != 0 ? HeightSource::kFilled
                                                     : HeightSource::kMeasured);
  }
  return absl::OkStatus();
}

// Chunk 0 and the layers in order; chunks that may be skipped are.
absl::Status SortChunks(const ChunkList& list, Chunk& control, std::vector<Chunk>& layers) {
  for (size_t i = 0; i < list.chunks.size(); ++i) {
    const Chunk& chunk = list.chunks[i];
    if (chunk.tag >= 'a' && chunk.tag <= 'z' && i > 0) continue;
    if ((chunk.tag == kControlTag) != (i == 0)) {
      return absl::DataLossError(absl::StrCat("the control mesh is not chunk 0 but chunk ", i));
    }
    if (i == 0) {
      control = chunk;
    } else if (chunk.tag == kHeightsTag) {
      layers.push_back(chunk);
    } else {
      return absl::UnimplementedError(
          absl::StrCat("chunk ", i, " is of a kind this decoder must know and does not, ",
                       static_cast<int>(chunk.tag)));
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<DecodedSurface> DecodeDss(std::span<const uint8_t> bytes,
                                         const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const ChunkList list, ListChunks(bytes));
  Chunk control;
  std::vector<Chunk> layers;
  RILIEVO_RETURN_IF_ERROR(SortChunks(list, control, layers));
  ByteReader reader(control.payload);
  const std::span<const uint8_t> head = reader.Bytes(reader.Varint());
  if (!reader.ok()) return absl::DataLossError("chunk 0 ends within its header");
  RILIEVO_ASSIGN_OR_RETURN(DssHeader header, DecodeDssHeader(head, list.version));
  if (static_cast<int>(layers.size()) > header.max_level + 1) {
    return absl::DataLossError(absl::StrCat("there are ", layers.size(),
                                            " height layers, max_level ", header.max_level, " has ",
                                            header.max_level + 1));
  }
  RILIEVO_RETURN_IF_ERROR(
      CheckLaw(header.vertex_count, kControlVerticesPerByte, control, "control vertices"));
  RILIEVO_RETURN_IF_ERROR(
      CheckLaw(header.face_count, kControlFacesPerByte, control, "control faces"));
  RILIEVO_ASSIGN_OR_RETURN(auto mesh_and_topology,
                           DecodeControl(reader.Bytes(reader.remaining()), header, list.version));
  DecodedSurface decoded;
  decoded.surface.frame = header.frame;
  decoded.surface.control_mesh = std::move(mesh_and_topology.first);
  if (layers.empty()) {
    decoded.surface.heights.assign(header.vertex_count, 0.0f);
    decoded.surface.sources.assign(header.vertex_count, HeightSource::kFilled);
  } else {
    RILIEVO_RETURN_IF_ERROR(DecodeHeights(layers, mesh_and_topology.second, header, list.version,
                                          context, decoded.surface));
  }
  decoded.metadata = std::move(header.metadata);
  decoded.format_version = list.version;
  decoded.declared_max_level = header.max_level;
  for (const Chunk& chunk : list.chunks) decoded.chunk_bytes.push_back(chunk.bytes);
  return decoded;
}

}  // namespace rilievo
