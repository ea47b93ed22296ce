#include "core/codec/container/encode_deformed.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/byte_stream.h"
#include "core/codec/bytes/stored_step.h"
#include "core/codec/container/deformed_surface.h"
#include "core/codec/container/encode_file.h"
#include "core/codec/container/open_dss.h"
#include "core/codec/mesh/gate_geometry.h"
#include "core/codec/mesh/group_coder.h"
#include "core/codec/mesh/prepare_control_mesh.h"

namespace rilievo {
namespace {

// Of control points that lie anywhere: half a step in each coordinate is less than 1e-7 in length.
constexpr double kFineStep = 1e-7;
// Within which a point counts as one of the file's grid, fraction of the diagonal.
constexpr double kOnGrid = 1e-9;

absl::Status CheckFile(const OpenedDss& file) {
  if (file.version < 3) {
    return absl::FailedPreconditionError(
        absl::StrCat("the file is of format version ", file.version,
                     "; only those of version 3 and on take another control mesh"));
  }
  return absl::OkStatus();
}

// On the file's grid where it lies there, else on a fine one around it: frame and step are its own.
struct PlacedCage {
  ControlMesh mesh;
  SpatialFrame frame;
  double step = 0;
  int border_digits = 0;
};

absl::StatusOr<PlacedCage> Place(const ControlMesh& given, const OpenedDss& file) {
  PlacedCage placed{{}, file.header.frame, file.header.position_step, file.header.border_digits};
  const double diagonal = placed.frame.diagonal;
  const Eigen::Matrix3Xd own = (file.mesh.vertices * diagonal).colwise() + placed.frame.center;
  ControlMesh cage = given;
  cage.vertices = WithoutRounding(given.vertices, own, diagonal);
  RILIEVO_ASSIGN_OR_RETURN(ControlMesh mesh,
                           ControlMeshOfCage(cage, placed.frame, file.mesh.faces));
  mesh.diagonals = file.mesh.diagonals;
  auto on_grid = QuantizeControlMesh(mesh, placed.step, placed.border_digits);
  if (on_grid.ok() && (on_grid->vertices - mesh.vertices).cwiseAbs().maxCoeff() <= kOnGrid) {
    placed.mesh = *std::move(on_grid);
    return placed;
  }
  const Eigen::Vector3d low = cage.vertices.rowwise().minCoeff();
  const Eigen::Vector3d high = cage.vertices.rowwise().maxCoeff();
  placed.frame.center = Rounded({(low + high) / 2, placed.frame.diagonal}).center;
  mesh.vertices = (cage.vertices.colwise() - placed.frame.center) / placed.frame.diagonal;
  placed.border_digits = 0;
  placed.step =
      StoredStep(std::max(kFineStep, 2 * mesh.vertices.cwiseAbs().maxCoeff() / kMaxCoordinate));
  RILIEVO_ASSIGN_OR_RETURN(placed.mesh, QuantizeControlMesh(mesh, placed.step));
  return placed;
}

bool AreSame(const ControlMesh& a, const ControlMesh& b) {
  return a.vertices == b.vertices && a.creases == b.creases && a.corners == b.corners;
}

// What follows the header: the groups of the heights too, where they are not those that the new
// control points would give.
std::vector<uint8_t> WithGroups(const OpenedDss& file, const DssDraft& draft, DssHeader* header) {
  header->group_limit = file.header.group_limit;
  header->tells_groups =
      draft.header.group_limit > 0 && draft.groups.members != file.groups.members;
  if (!header->tells_groups) return draft.coded_mesh;
  const std::vector<uint8_t> groups = EncodeGroups(file.groups, file.topology);
  std::vector<uint8_t> all;
  ByteWriter writer(all);
  writer.Varint(groups.size());
  writer.Bytes(groups);
  writer.Bytes(draft.coded_mesh);
  return all;
}

}  // namespace

absl::StatusOr<std::vector<uint8_t>> ReplaceControlMesh(std::span<const uint8_t> dss,
                                                        const ControlMesh& cage) {
  RILIEVO_ASSIGN_OR_RETURN(const OpenedDss file, OpenDss(dss, /*check_groups=*/true));
  RILIEVO_RETURN_IF_ERROR(CheckFile(file));
  RILIEVO_ASSIGN_OR_RETURN(const PlacedCage placed, Place(cage, file));
  if (AreSame(placed.mesh, file.mesh)) return std::vector<uint8_t>(dss.begin(), dss.end());
  const DssMetadata metadata = OfAnotherShape(file.header.metadata);
  EncodeOptions options;
  options.position_step = placed.step;
  options.border_digits = placed.border_digits;
  options.group_faces = file.header.group_limit;
  RILIEVO_ASSIGN_OR_RETURN(
      const DssDraft draft,
      DraftDss(placed.frame, placed.mesh, file.topology, file.header.max_level, metadata, options));
  DssHeader header = draft.header;
  header.metadata = metadata;
  header.height_unit = file.header.height_unit;
  header.has_filled = file.header.has_filled;
  const std::vector<uint8_t> coded = WithGroups(file, draft, &header);
  RILIEVO_ASSIGN_OR_RETURN(std::vector<uint8_t> bytes, ControlChunk(header, coded));
  RILIEVO_ASSIGN_OR_RETURN(const ChunkList list, ListChunks(dss, /*check=*/false));
  constexpr size_t kChecksumBytes = 4;
  const std::span<const uint8_t> control = list.chunks[0].payload;
  bytes.insert(bytes.end(), control.data() + control.size() + kChecksumBytes,
               dss.data() + dss.size());
  return bytes;
}

}  // namespace rilievo
