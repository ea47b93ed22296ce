#include <algorithm>
#include <cmath>
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

constexpr double kMaxStep = 0.01;

absl::Status CheckStep(double step, const char* name) {
  if (step > 0 && step <= kMaxStep) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("encode.", name, " is ", step, ", must be in (0, ", kMaxStep, "]"));
}

absl::StatusOr<std::vector<GridPoint>> GridPoints(const ControlMesh& mesh, double step) {
  std::vector<GridPoint> points(mesh.vertices.cols());
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      const double coordinate = mesh.vertices(axis, v);
      const double steps = std::nearbyint(coordinate / step);
      if (!(std::abs(steps) <= kMaxCoordinate) || steps * step != coordinate) {
        return absl::InvalidArgumentError(
            absl::StrCat("coordinate ", axis, " of control point ", v, " is ", coordinate,
                         ", no multiple of position_step ", step, ": call PrepareControlMesh"));
      }
      points[v][axis] = static_cast<int32_t>(steps);
    }
  }
  return points;
}

absl::StatusOr<GridHeights> QuantizeHeights(const DisplacedSurface& surface, double step) {
  GridHeights field;
  field.heights.reserve(surface.heights.size());
  field.residuals.reserve(surface.heights.size());
  field.sources = surface.sources;
  for (size_t v = 0; v < surface.heights.size(); ++v) {
    const double steps = std::nearbyint(static_cast<double>(surface.heights[v]) / step);
    if (!(std::abs(steps) <= kMaxHeightSteps)) {
      return absl::InvalidArgumentError(absl::StrCat("height ", v, " is ", surface.heights[v],
                                                     ", must be within ", kMaxHeightSteps,
                                                     " height steps of ", step));
    }
    field.heights.push_back(static_cast<int32_t>(steps));
    if (surface.sources[v] > HeightSource::kFilled) {
      return absl::InvalidArgumentError(absl::StrCat(
          "source ", v, " is ", static_cast<int>(surface.sources[v]), ", must be 0 to 2"));
    }
  }
  return field;
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

void PadTo(int64_t size, std::vector<uint8_t>& payload) {
  if (static_cast<int64_t>(payload.size()) < size) payload.resize(size, 0);
}

absl::StatusOr<std::vector<uint8_t>> ControlChunk(const DisplacedSurface& surface,
                                                  const MeshTopology& topology,
                                                  const DssMetadata& metadata,
                                                  const EncodeOptions& options) {
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<GridPoint> points,
                           GridPoints(surface.control_mesh, options.position_step));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> coded, EncodeControlMesh(topology, points));
  DssHeader header;
  header.vertex_count = topology.vertex_count;
  header.face_count = topology.face_count();
  header.has_boundary = topology.face_neighbors.minCoeff() < 0;
  header.max_level = surface.max_level;
  header.frame = surface.frame;
  header.position_step = options.position_step;
  header.height_step = options.height_step;
  header.metadata = metadata;
  const std::vector<uint8_t> head = EncodeDssHeader(header);
  // The reader's own checks of the frame and the counts, as an error of the caller's.
  if (absl::Status status = DecodeDssHeader(head).status(); !status.ok()) {
    return absl::InvalidArgumentError(status.message());
  }
  std::vector<uint8_t> payload;
  ByteWriter writer(payload);
  writer.Varint(head.size());
  writer.Bytes(head);
  writer.Bytes(coded);
  PadTo(std::max(BytesByLaw(header.vertex_count, kControlVerticesPerByte),
                 BytesByLaw(header.face_count, kControlFacesPerByte)),
        payload);
  return WrapChunk(kControlTag, payload, true);
}

}  // namespace

absl::Status EncodeOptions::Validate() const {
  RILIEVO_RETURN_IF_ERROR(CheckStep(height_step, "height_step"));
  return CheckStep(position_step, "position_step");
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
  RILIEVO_ASSIGN_OR_RETURN(GridHeights field, QuantizeHeights(surface, options.height_step));
  EncodedSurface encoded;
  RILIEVO_ASSIGN_OR_RETURN(std::vector<uint8_t> control,
                           ControlChunk(surface, refinement.levels[0], metadata, options));
  encoded.chunks.push_back(std::move(control));
  for (int level = 0; level <= surface.max_level; ++level) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    context.Report(Stage::kEncode, (1.0 + level) / (2.0 + surface.max_level));
    const MeshTopology& topology = refinement.levels[std::max(0, level - 1)];
    std::vector<uint8_t> payload = EncodeHeightLayer(topology, level == 0, field);
    PadTo(BytesByLaw(level == 0 ? topology.vertex_count : topology.edge_count(), kHeightsPerByte),
          payload);
    encoded.chunks.push_back(WrapChunk(kHeightsTag, payload, false));
  }
  context.Report(Stage::kEncode, 1);
  return encoded;
}

}  // namespace rilievo
