#include "core/control/creases/sharp_edges.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/control/creases/line_corners.h"
#include "core/control/creases/settings.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/vertex_normals.h"
#include "core/loop/crease_topology.h"
#include "core/points/settings.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

class SharpEdges {
 public:
  SharpEdges(const ControlMesh& mesh, MeshTopology topology, double spacing)
      : mesh_(mesh), topology_(std::move(topology)), spacing_(spacing) {
    FindNormals();
    for (int e = 0; e < topology_.edge_count(); ++e) {
      angles_.push_back(topology_.edge_faces(1, e) < 0 ? 0 : AngleAt(e));
      sharp_.push_back(angles_.back() >= kCommon.sharp_angle);
    }
  }

  bool AreClean() const {
    double clean = 0, all = 0;
    for (int e = 0; e < topology_.edge_count(); ++e) {
      if (sharp_[e] == 0) continue;
      all += Length(e);
      if (IsClean(e)) clean += Length(e);
    }
    return all > 0 && clean >= kSharpEdges.clean_share * all;
  }

  // Lines run on past their free ends.
  void LeadOn() {
    std::vector<std::vector<int>> edges(static_cast<size_t>(topology_.vertex_count));
    std::vector<int> ends;
    for (int e = 0; e < topology_.edge_count(); ++e) {
      for (const int v : topology_.edge_vertices.col(e)) edges[v].push_back(e);
      if (sharp_[e] == 0) continue;
      for (const int v : topology_.edge_vertices.col(e)) ends.push_back(v);
    }
    while (!ends.empty()) {
      const int v = ends.back();
      ends.pop_back();
      const int next = EdgeThatLeadsOn(v, edges[v]);
      if (next < 0) continue;
      sharp_[next] = 1;
      ends.push_back(Other(v, next));
    }
  }

  absl::Status DropShortRuns(const RunContext& context, ControlMesh* tagged) {
    for (bool dropped = true; dropped;) {
      RILIEVO_RETURN_IF_ERROR(context.CheckStop());
      dropped = false;
      tagged->creases = TaggedEdges(topology_, sharp_);
      RILIEVO_ASSIGN_OR_RETURN(const CreaseTopology creases,
                               BuildCreaseTopology(*tagged, topology_));
      chains_ = CreaseChains(topology_, creases);
      for (const CreaseChain& chain : chains_) {
        const auto is_free = [&](int v) { return creases.kinds[v] == VertexKind::kDart; };
        const bool is_loose =
            chain.closed || is_free(chain.vertices.front()) || is_free(chain.vertices.back());
        double length = 0;
        for (const int e : chain.edges) length += Length(e);
        if (!is_loose || length > kSharpEdges.shortest_loose_run * spacing_) continue;
        for (const int e : chain.edges) sharp_[e] = 0;
        dropped = true;
      }
    }
    return absl::OkStatus();
  }

  // Of all lines, where one turns most within half a spacing.
  std::vector<int> Corners() const {
    std::vector<int> corners;
    for (const CreaseChain& line : chains_) {
      const std::vector<int> turns = CornersOfLine(mesh_.vertices, line, kSharpEdges.corner,
                                                   kSharpEdges.turn_spacings * spacing_);
      corners.insert(corners.end(), turns.begin(), turns.end());
    }
    std::sort(corners.begin(), corners.end());
    corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
    return corners;
  }

 private:
  Vector3d At(int v) const { return mesh_.vertices.col(v); }
  double Length(int e) const {
    return (At(topology_.edge_vertices(0, e)) - At(topology_.edge_vertices(1, e))).norm();
  }
  int Other(int v, int e) const {
    const auto ends = topology_.edge_vertices.col(e);
    return ends[0] == v ? ends[1] : ends[0];
  }
  Vector3d Way(int v, int e) const { return (At(Other(v, e)) - At(v)).normalized(); }

  // A thin triangle has the normal of the one across its longest edge.
  void FindNormals() {
    const int count = topology_.face_count();
    normals_.resize(3, count);
    std::vector<int> stands_for(static_cast<size_t>(count));
    for (int f = 0; f < count; ++f) {
      const Vector3d cross = FaceCross(mesh_.vertices, topology_.faces, f);
      int longest = 0;
      double most = 0;
      for (int k = 0; k < 3; ++k) {
        const double length = Length(topology_.face_edges(k, f));
        if (length > most) {
          most = length;
          longest = k;
        }
      }
      normals_.col(f) = cross.normalized();
      const bool thin = cross.norm() < kSharpEdges.thin * spacing_ * most;
      const int across = topology_.face_neighbors(longest, f);
      stands_for[f] = thin && across >= 0 ? across : f;
    }
    for (int f = 0; f < count; ++f) {
      int root = f;
      for (int step = 0; step < kSharpEdges.most_steps && stands_for[root] != root; ++step)
        root = stands_for[root];
      if (root != f) normals_.col(f) = Vector3d(normals_.col(root));
    }
  }

  // Where a line ends at v, the edge that goes on straightest; else -1. `edges`: those at v.
  int EdgeThatLeadsOn(int v, const std::vector<int>& edges) const {
    const auto is_sharp = [&](int e) { return sharp_[e] != 0; };
    const auto last = std::find_if(edges.begin(), edges.end(), is_sharp);
    if (topology_.boundary_vertex[v] != 0 ||
        std::count_if(edges.begin(), edges.end(), is_sharp) != 1) {
      return -1;
    }
    int next = -1;
    double straightest = std::cos(kSharpEdges.corner);
    for (const int e : edges) {
      if (is_sharp(e) || angles_[e] < kSharpEdges.leads_on * kCommon.sharp_angle || !IsClean(e))
        continue;
      const double cosine = -Way(v, e).dot(Way(v, *last));
      if (cosine <= straightest) continue;
      straightest = cosine;
      next = e;
    }
    return next;
  }

  double AngleAt(int e) const {
    const Vector3d a = normals_.col(topology_.edge_faces(0, e)),
                   b = normals_.col(topology_.edge_faces(1, e));
    return std::atan2(a.cross(b).norm(), a.dot(b));
  }

  bool IsClean(int e) const {
    for (int side = 0; side < 2; ++side) {
      const int face = topology_.edge_faces(side, e);
      for (const int other : topology_.face_edges.col(face)) {
        if (other != e && sharp_[other] == 0 && angles_[other] > kSharpEdges.beside * angles_[e])
          return false;
      }
    }
    return true;
  }

  const ControlMesh& mesh_;
  const MeshTopology topology_;
  const double spacing_;
  Eigen::Matrix3Xd normals_;  // of faces
  std::vector<double> angles_;
  std::vector<uint8_t> sharp_;
  std::vector<CreaseChain> chains_;
};

}  // namespace

absl::Status TagSharpEdges(double spacing, const RunContext& context, ControlMesh* mesh) {
  RILIEVO_ASSIGN_OR_RETURN(MeshTopology topology,
                           BuildMeshTopology(mesh->faces, static_cast<int>(mesh->vertices.cols())));
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  SharpEdges edges(*mesh, std::move(topology), spacing);
  if (!edges.AreClean()) return absl::OkStatus();
  edges.LeadOn();
  ControlMesh tagged{mesh->vertices, mesh->faces, {}, {}};
  RILIEVO_RETURN_IF_ERROR(edges.DropShortRuns(context, &tagged));
  tagged.corners = edges.Corners();
  *mesh = std::move(tagged);
  return absl::OkStatus();
}

}  // namespace rilievo
