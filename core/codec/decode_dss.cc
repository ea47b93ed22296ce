#include <algorithm>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/byte_stream.h"
#include "core/codec/chunk.h"
#include "core/codec/control_mesh_coder.h"
#include "core/codec/decode_law.h"
#include "core/codec/dss.h"
#include "core/codec/dss_header.h"
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
                                                                   const DssHeader& header) {
  RILIEVO_ASSIGN_OR_RETURN(
      GridMesh grid,
      DecodeControlMesh(bytes, header.vertex_count, header.face_count, header.has_boundary));
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

absl::Status DecodeHeights(const std::vector<Chunk>& layers, const MeshTopology& control,
                           const DssHeader& header, const RunContext& context,
                           DisplacedSurface& surface) {
  const int level_count = static_cast<int>(layers.size());
  const std::vector<int64_t> counts = NewVertexCounts(control, level_count);
  for (int level = 0; level < level_count; ++level) {
    RILIEVO_RETURN_IF_ERROR(CheckLaw(counts[level], kHeightsPerByte, layers[level], "heights"));
  }
  RILIEVO_ASSIGN_OR_RETURN(
      const LoopRefinement refinement,
      RefineTopology(surface.control_mesh, std::max(0, level_count - 2), context));
  GridHeights field;
  for (int level = 0; level < level_count; ++level) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    RILIEVO_RETURN_IF_ERROR(DecodeHeightLayer(
        layers[level].payload, refinement.levels[std::max(0, level - 1)], level == 0, field));
  }
  surface.max_level = level_count - 1;
  surface.heights.reserve(field.heights.size());
  for (int32_t steps : field.heights) {
    surface.heights.push_back(static_cast<float>(steps * header.height_step));
  }
  surface.sources = std::move(field.sources);
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
  RILIEVO_ASSIGN_OR_RETURN(DssHeader header, DecodeDssHeader(head));
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
                           DecodeControl(reader.Bytes(reader.remaining()), header));
  DecodedSurface decoded;
  decoded.surface.frame = header.frame;
  decoded.surface.control_mesh = std::move(mesh_and_topology.first);
  if (layers.empty()) {
    decoded.surface.heights.assign(header.vertex_count, 0.0f);
    decoded.surface.sources.assign(header.vertex_count, HeightSource::kFilled);
  } else {
    RILIEVO_RETURN_IF_ERROR(
        DecodeHeights(layers, mesh_and_topology.second, header, context, decoded.surface));
  }
  decoded.metadata = std::move(header.metadata);
  decoded.format_version = list.version;
  decoded.declared_max_level = header.max_level;
  for (const Chunk& chunk : list.chunks) decoded.chunk_bytes.push_back(chunk.bytes);
  return decoded;
}

}  // namespace rilievo
