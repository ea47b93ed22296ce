#include "core/codec/container/decode_region.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <set>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/container/colors.h"
#include "core/codec/container/dss.h"
#include "core/codec/container/height_update.h"
#include "core/codec/container/open_dss.h"
#include "core/codec/heights/height_decoder.h"
#include "core/loop/face_vertices.h"
#include "core/loop/refinement.h"
#include "core/loop/sub_mesh.h"

namespace rilievo {
namespace {

absl::Status CheckFaces(std::span<const int> faces, int count) {
  for (size_t i = 0; i < faces.size(); ++i) {
    if (faces[i] >= 0 && faces[i] < count && (i == 0 || faces[i] > faces[i - 1])) continue;
    return absl::InvalidArgumentError(absl::StrCat("control face ", faces[i], " at place ", i,
                                                   ": they must ascend and lie within 0 to ",
                                                   count - 1));
  }
  return absl::OkStatus();
}

absl::StatusOr<int> CheckedLevel(int level, int max_level) {
  if (level == kFinestLevel) return max_level;
  if (level >= 0 && level <= max_level) return level;
  return absl::InvalidArgumentError(
      absl::StrCat("level is ", level, ", regions of these bytes have 0 to ", max_level));
}

// The region's vertices are numbered as the whole's, so these must fit, and the whole must be one
// that RefineTopology() takes.
absl::Status CheckNumbers(const OpenedDss& file) {
  const int steps = static_cast<int>(file.layers.size()) - 1;
  int64_t vertices = file.topology.vertex_count, edges = file.topology.edge_count(),
          faces = file.topology.face_count();
  for (int step = 0; step < steps; ++step) {
    if (faces > kMaxLoopFaces) break;
    vertices += edges;
    edges = 2 * edges + 3 * faces;
    faces *= 4;
  }
  if (faces / 4 <= kMaxLoopFaces && vertices <= std::numeric_limits<int>::max()) {
    return absl::OkStatus();
  }
  return absl::ResourceExhaustedError(absl::StrCat(file.topology.face_count(),
                                                   " control faces at level ", steps,
                                                   " are more than can be numbered"));
}

// Sources and colours of the region's vertices.
void TakeValuesOf(const DisplacedSurface& surface, DecodedRegion& decoded) {
  for (int v : decoded.region.vertices) {
    decoded.sources.push_back(surface.sources[v]);
    if (!surface.colors.empty()) decoded.colors.push_back(surface.colors[v]);
  }
}

absl::StatusOr<DecodedRegion> OfWholeDecode(std::span<const uint8_t> bytes,
                                            std::span<const int> faces, int level,
                                            const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface decoded, DecodeDss(bytes, context));
  DecodedRegion region;
  RILIEVO_ASSIGN_OR_RETURN(region.level, CheckedLevel(level, decoded.surface.max_level));
  RILIEVO_ASSIGN_OR_RETURN(region.region,
                           TessellateRegion(decoded.surface, faces, region.level, context));
  TakeValuesOf(decoded.surface, region);
  return region;
}

// The vertices of a part's mesh under their numbers in the whole, in the order of those.
void Renumber(const std::vector<int>& whole_vertex, DecodedRegion& decoded) {
  RegionMesh& region = decoded.region;
  const size_t count = region.vertices.size();
  for (int& v : region.vertices) v = whole_vertex[v];
  std::vector<int> order(count), place(count);
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return region.vertices[a] < region.vertices[b]; });
  DecodedRegion sorted;
  sorted.region.mesh.vertices.resize(3, static_cast<Eigen::Index>(count));
  sorted.region.mesh.normals.resize(3, static_cast<Eigen::Index>(count));
  for (size_t i = 0; i < count; ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    sorted.region.mesh.vertices.col(column) = region.mesh.vertices.col(order[i]);
    sorted.region.mesh.normals.col(column) = region.mesh.normals.col(order[i]);
    sorted.region.vertices.push_back(region.vertices[order[i]]);
    sorted.sources.push_back(decoded.sources[order[i]]);
    if (!decoded.colors.empty()) sorted.colors.push_back(decoded.colors[order[i]]);
    place[order[i]] = static_cast<int>(i);
  }
  sorted.region.mesh.triangles = region.mesh.triangles.unaryExpr([&](int v) { return place[v]; });
  decoded.region = std::move(sorted.region);
  decoded.sources = std::move(sorted.sources);
  decoded.colors = std::move(sorted.colors);
}

}  // namespace

absl::StatusOr<PartDecoder> PartDecoder::Open(const OpenedDss& file, const PartCutter& cutter,
                                              const RunContext& context) {
  auto shared = std::make_unique<LoopRefinement>();
  shared->levels.push_back(file.topology);
  RILIEVO_ASSIGN_OR_RETURN(
      PartHeights heights,
      PartHeights::Open(file.Payloads(), *shared, file.groups, file.header.has_filled,
                        file.SmoothedPayload(), context));
  return PartDecoder(file, cutter, std::move(shared), std::move(heights));
}

absl::StatusOr<SurfacePart> PartDecoder::Decode(std::span<const int> control_faces,
                                                const RunContext& context) const {
  // Normals take the triangles of the faces that touch the wanted ones, whose heights have to be
  // right: the cutter adds that ring.
  SubMesh sub = cutter_.Cut(control_faces, kHeightReach);
  SurfacePart made;
  DisplacedSurface& part = made.surface;
  part.frame = file_.header.frame;
  part.max_level = static_cast<int>(file_.layers.size()) - 1;
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement,
                           RefineTopology(sub.mesh, part.max_level - 1, context));
  RILIEVO_ASSIGN_OR_RETURN(const DecodedHeights heights,
                           heights_.Decode(sub.faces, refinement, context));
  for (int32_t height : heights.heights) {
    part.heights.push_back(static_cast<float>(height * file_.header.height_unit));
  }
  part.sources = heights.Sources(file_.header.metadata.all_smoothed);
  RILIEVO_RETURN_IF_ERROR(ApplyUpdatesToPart(file_, *shared_, sub.faces, refinement, context,
                                             &part.heights, &part.sources));
  if (!file_.colors.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(part.colors,
                             DecodePartOfColors(file_, *shared_, sub.faces, refinement, context));
  }
  part.control_mesh = std::move(sub.mesh);
  made.faces = std::move(sub.faces);
  made.inner = PlacesOf(control_faces, made.faces);
  return made;
}

absl::StatusOr<DecodedRegion> DecodeRegion(std::span<const uint8_t> bytes,
                                           std::span<const int> control_faces, int level,
                                           const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const OpenedDss file, OpenDss(bytes, false));
  RILIEVO_RETURN_IF_ERROR(CheckFaces(control_faces, file.topology.face_count()));
  // Of a file that ends between the heights and the colours of a level, coarser colours take part.
  const bool lacks_colors = !file.colors.empty() && file.colors.size() < file.layers.size();
  if (file.header.group_limit == 0 || file.layers.size() <= kFirstGroupedLevel ||
      control_faces.empty() || lacks_colors) {
    return OfWholeDecode(bytes, control_faces, level, context);
  }
  RILIEVO_RETURN_IF_ERROR(CheckHeightLaw(file));
  RILIEVO_RETURN_IF_ERROR(CheckNumbers(file));
  const int max_level = static_cast<int>(file.layers.size()) - 1;
  DecodedRegion decoded;
  RILIEVO_ASSIGN_OR_RETURN(decoded.level, CheckedLevel(level, max_level));
  RILIEVO_ASSIGN_OR_RETURN(const PartCutter cutter, PartCutter::Make(file.mesh, file.topology));
  RILIEVO_ASSIGN_OR_RETURN(const PartDecoder decoder, PartDecoder::Open(file, cutter, context));
  RILIEVO_ASSIGN_OR_RETURN(const SurfacePart part, decoder.Decode(control_faces, context));
  const ControlMesh& mesh = part.surface.control_mesh;
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                           BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())));
  RILIEVO_ASSIGN_OR_RETURN(decoded.region,
                           TessellateRegion(part.surface, part.inner, decoded.level, context));
  TakeValuesOf(part.surface, decoded);
  Renumber(VerticesThere(FaceVertices(topology, decoded.level),
                         FaceVertices(file.topology, decoded.level), part.faces),
           decoded);
  std::set<int> groups;
  for (int f : part.faces) groups.insert(file.groups.group_of[f]);
  decoded.groups_read = static_cast<int64_t>(groups.size());
  decoded.groups = file.groups.count();
  return decoded;
}

std::vector<int> ControlFacesInBox(const SpatialFrame& frame, const ControlMesh& mesh,
                                   const Eigen::AlignedBox3d& box) {
  std::vector<int> faces;
  for (Eigen::Index f = 0; f < mesh.faces.cols(); ++f) {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    bool inside = false;
    for (int v : mesh.faces.col(f)) {
      const Eigen::Vector3d corner = mesh.vertices.col(v);
      inside = inside || box.contains(frame.ScanFromUnit(corner));
      middle += corner / 3;
    }
    if (inside || box.contains(frame.ScanFromUnit(middle))) faces.push_back(static_cast<int>(f));
  }
  return faces;
}

}  // namespace rilievo
