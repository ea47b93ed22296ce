#include "core/codec/container/encode_deformed.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/stored_step.h"
#include "core/codec/container/encode_file.h"
#include "core/codec/container/open_dss.h"
#include "core/codec/mesh/gate_geometry.h"
#include "core/codec/mesh/prepare_control_mesh.h"

namespace rilievo {
namespace {

// Of control points that lie anywhere: half a step in each coordinate is less than 1e-7 in length.
constexpr double kFineStep = 1e-7;
// Within which a point counts as one of the file's grid: digits lost on the way through text.
constexpr double kOnGrid = 1e-9;

using FaceCorners = std::array<int, 3>;

// The same for every corner that a face may begin with.
std::vector<FaceCorners> SortedFaces(const Eigen::Matrix3Xi& faces) {
  std::vector<FaceCorners> sorted;
  sorted.reserve(static_cast<size_t>(faces.cols()));
  for (const auto face : faces.colwise()) {
    FaceCorners corners = {face[0], face[1], face[2]};
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    sorted.push_back(corners);
  }
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

absl::Status CheckCage(const ControlMesh& cage, const ControlMesh& own) {
  if (cage.vertices.cols() != own.vertices.cols() || cage.faces.cols() != own.faces.cols()) {
    return absl::InvalidArgumentError(
        absl::StrCat("the cage has ", cage.vertices.cols(), " vertices and ", cage.faces.cols(),
                     " faces, the control mesh ", own.vertices.cols(), " and ", own.faces.cols(),
                     "; vertices may move, but none may come or go"));
  }
  const std::vector<FaceCorners> expected = SortedFaces(own.faces), found = SortedFaces(cage.faces);
  const auto differ = std::mismatch(found.begin(), found.end(), expected.begin());
  if (differ.first != found.end()) {
    const FaceCorners& face = *differ.first;
    return absl::InvalidArgumentError(
        absl::StrCat("face (", face[0], ", ", face[1], ", ", face[2],
                     "), vertices counted from 0, is not a face of the control mesh; keep the "
                     "order of the vertices"));
  }
  if (!cage.vertices.allFinite()) {
    return absl::InvalidArgumentError("a vertex of the cage is not finite");
  }
  return absl::OkStatus();
}

absl::Status CheckFile(const OpenedDss& file) {
  if (file.version != kDssVersion) {
    return absl::FailedPreconditionError(absl::StrCat("the file is of format version ",
                                                      file.version, "; only those of version ",
                                                      kDssVersion, " take another control mesh"));
  }
  if (file.header.group_limit > 0) {
    return absl::FailedPreconditionError(absl::StrCat(
        "the heights of this surface stand in groups, which hang on its ", file.header.vertex_count,
        " control points; make it with fewer than 4096 control faces"));
  }
  return absl::OkStatus();
}

ControlMesh InUnitFrame(const ControlMesh& cage, const SpatialFrame& frame,
                        const Eigen::Matrix3Xi& faces) {
  ControlMesh mesh = cage;
  mesh.faces = faces;
  mesh.vertices = (cage.vertices.colwise() - frame.center) / frame.diagonal;
  for (Crease& crease : mesh.creases) {
    if (crease.a > crease.b) std::swap(crease.a, crease.b);
  }
  std::sort(mesh.creases.begin(), mesh.creases.end(), [](const Crease& p, const Crease& q) {
    return std::pair(p.a, p.b) < std::pair(q.a, q.b);
  });
  // What is tagged twice is tagged.
  mesh.creases.erase(
      std::unique(mesh.creases.begin(), mesh.creases.end(),
                  [](const Crease& p, const Crease& q) { return p.a == q.a && p.b == q.b; }),
      mesh.creases.end());
  std::sort(mesh.corners.begin(), mesh.corners.end());
  mesh.corners.erase(std::unique(mesh.corners.begin(), mesh.corners.end()), mesh.corners.end());
  return mesh;
}

// On the file's grid where it lies there, else on a fine one around it: frame and step are its own.
struct PlacedCage {
  ControlMesh mesh;
  SpatialFrame frame;
  double step = 0;
};

absl::StatusOr<PlacedCage> Place(const ControlMesh& cage, const OpenedDss& file) {
  PlacedCage placed{{}, file.header.frame, file.header.position_step};
  ControlMesh mesh = InUnitFrame(cage, placed.frame, file.mesh.faces);
  auto on_grid = QuantizeControlMesh(mesh, placed.step);
  if (on_grid.ok() && (on_grid->vertices - mesh.vertices).cwiseAbs().maxCoeff() <= kOnGrid) {
    placed.mesh = *std::move(on_grid);
    return placed;
  }
  const Eigen::Vector3d low = cage.vertices.rowwise().minCoeff();
  const Eigen::Vector3d high = cage.vertices.rowwise().maxCoeff();
  placed.frame = Rounded({(low + high) / 2, placed.frame.diagonal});
  mesh = InUnitFrame(cage, placed.frame, file.mesh.faces);
  placed.step =
      StoredStep(std::max(kFineStep, 2 * mesh.vertices.cwiseAbs().maxCoeff() / kMaxCoordinate));
  RILIEVO_ASSIGN_OR_RETURN(placed.mesh, QuantizeControlMesh(mesh, placed.step));
  return placed;
}

bool AreSame(const ControlMesh& a, const ControlMesh& b) {
  return a.vertices == b.vertices && a.creases == b.creases && a.corners == b.corners;
}

// Without what is true of the surface that was scanned alone.
DssMetadata OfAnotherShape(const DssMetadata& metadata) {
  DssMetadata kept;
  kept.generator = metadata.generator;
  kept.measured_share = metadata.measured_share;
  kept.smoothed_share = metadata.smoothed_share;
  kept.filled_share = metadata.filled_share;
  kept.topology = metadata.topology;
  kept.options = metadata.options;
  kept.place = metadata.place;
  kept.colors = metadata.colors;
  kept.all_smoothed = metadata.all_smoothed;
  kept.plain_levels = metadata.plain_levels;
  return kept;
}

}  // namespace

absl::StatusOr<std::vector<uint8_t>> ReplaceControlMesh(std::span<const uint8_t> dss,
                                                        const ControlMesh& cage) {
  RILIEVO_ASSIGN_OR_RETURN(const OpenedDss file, OpenDss(dss, /*check_groups=*/true));
  RILIEVO_RETURN_IF_ERROR(CheckFile(file));
  RILIEVO_RETURN_IF_ERROR(CheckCage(cage, file.mesh));
  RILIEVO_ASSIGN_OR_RETURN(const PlacedCage placed, Place(cage, file));
  if (AreSame(placed.mesh, file.mesh)) return std::vector<uint8_t>(dss.begin(), dss.end());
  const DssMetadata metadata = OfAnotherShape(file.header.metadata);
  EncodeOptions options;
  options.position_step = placed.step;
  options.group_faces = 0;
  RILIEVO_ASSIGN_OR_RETURN(
      const DssDraft draft,
      DraftDss(placed.frame, placed.mesh, file.topology, file.header.max_level, metadata, options));
  DssHeader header = draft.header;
  header.metadata = metadata;
  header.height_unit = file.header.height_unit;
  header.has_filled = file.header.has_filled;
  RILIEVO_ASSIGN_OR_RETURN(std::vector<uint8_t> bytes, ControlChunk(header, draft.coded_mesh));
  RILIEVO_ASSIGN_OR_RETURN(const ChunkList list, ListChunks(dss, /*check=*/false));
  constexpr size_t kChecksumBytes = 4;
  const std::span<const uint8_t> control = list.chunks[0].payload;
  bytes.insert(bytes.end(), control.data() + control.size() + kChecksumBytes,
               dss.data() + dss.size());
  return bytes;
}

}  // namespace rilievo
