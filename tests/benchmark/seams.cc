#include "tests/benchmark/seams.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <vector>

#include "core/base/status_macros.h"
#include "core/codec/container/dss.h"
#include "core/codec/container/open_dss.h"
#include "core/loop/face_vertices.h"
#include "core/loop/patch_lattice.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

// An edge on the side of a face, in the direction of the face, and the corner opposite to it.
using SideEdge = std::array<int, 3>;

// Places in FaceVertices' order, from corner k to corner k + 1.
std::vector<SideEdge> EdgesOfSide(const PatchLattice& lattice, int side) {
  std::vector<int> along = {lattice.corners()[side]};
  along.insert(along.end(), lattice.sides()[side].begin(), lattice.sides()[side].end());
  along.push_back(lattice.corners()[(side + 1) % 3]);
  std::vector<int> place(lattice.point_count(), -1);
  for (size_t i = 0; i < along.size(); ++i) place[along[i]] = static_cast<int>(i);
  std::vector<SideEdge> edges(along.size() - 1);
  for (const auto triangle : lattice.triangles().colwise()) {
    for (int k = 0; k < 3; ++k) {
      const int a = triangle[k], b = triangle[(k + 1) % 3];
      if (place[a] >= 0 && place[b] == place[a] + 1) {
        edges[place[a]] = {a, b, triangle[(k + 2) % 3]};
      }
    }
  }
  return edges;
}

class SeamMeasurer {
 public:
  SeamMeasurer(const OpenedDss& file, const DisplacedSurface& surface, const TriangleMesh& mesh)
      : file_(file),
        surface_(surface),
        mesh_(mesh),
        lattice_(surface.max_level),
        vertices_(file.topology, surface.max_level) {
    for (int side = 0; side < 3; ++side) edges_[side] = EdgesOfSide(lattice_, side);
  }

  SeamFigures Run() {
    for (int f = 0; f < file_.topology.face_count(); ++f) {
      for (int side = 0; side < 3; ++side) {
        const int neighbor = file_.topology.face_neighbors(side, f);
        if (neighbor > f) AddControlEdge(f, side, neighbor);
      }
    }
    return {border_.Figures(), inside_.Figures()};
  }

 private:
  struct Sums {
    int64_t control_edges = 0, edges = 0;
    double angle = 0, bend = 0;
    EdgeFigures Figures() const {
      const auto count = static_cast<double>(edges);
      return {control_edges, std::sqrt(angle / count), std::sqrt(bend / count)};
    }
  };

  void AddControlEdge(int face, int side, int neighbor) {
    const std::vector<int>& group = file_.groups.group_of;
    Sums& sums = group[face] == group[neighbor] ? inside_ : border_;
    const int other = CornerOfEdge(file_.topology, neighbor, file_.topology.face_edges(side, face));
    vertices_.Of(face, here_);
    vertices_.Of(neighbor, there_);
    const size_t count = edges_[side].size();
    ++sums.control_edges;
    for (size_t i = 0; i < count; ++i) {
      const SideEdge& edge = edges_[side][i];
      AddEdge(here_[edge[0]], here_[edge[1]], here_[edge[2]],
              there_[edges_[other][count - 1 - i][2]], sums);
    }
  }

  void AddEdge(int a, int b, int left, int right, Sums& sums) const {
    for (const int v : {a, b, left, right}) {
      if (surface_.sources[v] == HeightSource::kFilled) return;
    }
    const Vector3d at = mesh_.vertices.col(a), along = mesh_.vertices.col(b) - at;
    const Vector3d normal = along.cross(mesh_.vertices.col(left) - at);
    const Vector3d opposite = (mesh_.vertices.col(right) - at).cross(along);
    const double angle = std::atan2(normal.cross(opposite).norm(), normal.dot(opposite));
    const std::vector<float>& h = surface_.heights;
    const double bend = double{h[left]} + h[right] - h[a] - h[b];
    sums.angle += angle * angle;
    sums.bend += bend * bend;
    ++sums.edges;
  }

  const OpenedDss& file_;
  const DisplacedSurface& surface_;
  const TriangleMesh& mesh_;
  PatchLattice lattice_;
  FaceVertices vertices_;
  std::array<std::vector<SideEdge>, 3> edges_;
  std::vector<int> here_, there_;
  Sums border_, inside_;
};

}  // namespace

absl::StatusOr<SeamFigures> MeasureSeams(std::span<const uint8_t> dss, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const OpenedDss file, OpenDss(dss, true));
  if (file.header.group_limit == 0 || file.header.max_level == 0) {
    return absl::FailedPreconditionError("the file has no groups of control faces");
  }
  RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface decoded, DecodeDss(dss, context));
  RILIEVO_ASSIGN_OR_RETURN(const TriangleMesh mesh,
                           Tessellate(decoded.surface, decoded.surface.max_level, context));
  return SeamMeasurer(file, decoded.surface, mesh).Run();
}

}  // namespace rilievo
