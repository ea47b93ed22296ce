#include "core/control/creases/tag_creases.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/control/creases/classify_edges.h"
#include "core/control/simplify/collapse_guards.h"
#include "core/control/simplify/quadric.h"
#include "core/geometry/mesh_topology.h"
#include "core/loop/crease_topology.h"
#include "core/points/point_support.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr size_t kShortestRun = 3;
// Least mean log_likelihood_ratio of the edges of a run.
constexpr double kRunEvidence = 24;
// A crease that turns further than this in a vertex has a corner there: cos 50 degrees.
constexpr double kCornerCosine = 0.64;
// Pull of a vertex to its place, beside one for each plane through it.
constexpr double kStay = 0.003;
// A vertex comes no farther from the points.
constexpr double kReachSpacings = 1.5;

// Weak edges stay where they lead on from a strong one.
std::vector<uint8_t> Tags(const MeshTopology& topology,
                          const std::vector<EdgeClassification>& judgements) {
  std::vector<uint8_t> tags(judgements.size(), 0), reached(topology.vertex_count, 0);
  for (size_t e = 0; e < tags.size(); ++e) {
    tags[e] = judgements[e].edge_class == EdgeClass::kStrong;
  }
  for (bool grown = true; grown;) {
    grown = false;
    for (size_t e = 0; e < tags.size(); ++e) {
      if (!tags[e]) continue;
      for (int k = 0; k < 2; ++k) reached[topology.edge_vertices(k, e)] = 1;
    }
    for (size_t e = 0; e < tags.size(); ++e) {
      if (tags[e] || judgements[e].edge_class != EdgeClass::kWeak) continue;
      if (!reached[topology.edge_vertices(0, e)] && !reached[topology.edge_vertices(1, e)])
        continue;
      tags[e] = 1;
      grown = true;
    }
  }
  return tags;
}

std::vector<Crease> CreasesOf(const MeshTopology& topology, const std::vector<uint8_t>& tags) {
  std::vector<Crease> creases;
  for (int e = 0; e < topology.edge_count(); ++e) {
    if (!tags[e]) continue;
    creases.push_back({topology.edge_vertices(0, e), topology.edge_vertices(1, e)});
  }
  std::sort(creases.begin(), creases.end(), [](const Crease& p, const Crease& q) {
    return std::pair(p.a, p.b) < std::pair(q.a, q.b);
  });
  return creases;
}

// A face with three sharp edges is a sliver on a crease: the longest one passes its two others by.
void OpenTriangles(const MeshTopology& topology, const ControlMesh& mesh,
                   std::vector<uint8_t>* tags) {
  for (int f = 0; f < topology.face_count(); ++f) {
    int longest = -1;
    double most = -1;
    bool all = true;
    for (int k = 0; k < 3; ++k) {
      const int edge = topology.face_edges(k, f);
      all &= (*tags)[edge] != 0;
      const auto ends = topology.edge_vertices.col(edge);
      const double square = (mesh.vertices.col(ends[0]) - mesh.vertices.col(ends[1])).squaredNorm();
      if (square > most) {
        most = square;
        longest = edge;
      }
    }
    if (all) (*tags)[longest] = 0;
  }
}

// Takes the tags off runs that are short and end freely, and off those that say little; what they
// ended at may change its kind, so again.
absl::Status DropPoorRuns(const MeshTopology& topology,
                          const std::vector<EdgeClassification>& judgements, ControlMesh* mesh,
                          std::vector<uint8_t>* tags) {
  for (bool dropped = true; dropped;) {
    dropped = false;
    mesh->creases = CreasesOf(topology, *tags);
    RILIEVO_ASSIGN_OR_RETURN(const CreaseTopology creases, BuildCreaseTopology(*mesh, topology));
    for (const CreaseChain& chain : CreaseChains(topology, creases)) {
      double log_likelihood_ratio = 0;
      for (int edge : chain.edges)
        log_likelihood_ratio += judgements[edge].planes->log_likelihood_ratio;
      const auto free_end = [&](int v) { return creases.kinds[v] == VertexKind::kDart; };
      const bool loose = free_end(chain.vertices.front()) || free_end(chain.vertices.back());
      const bool is_short = !chain.closed && loose && chain.edges.size() < kShortestRun;
      const double mean = log_likelihood_ratio / static_cast<double>(chain.edges.size());
      if (!is_short && mean >= kRunEvidence) continue;
      for (int edge : chain.edges) (*tags)[edge] = 0;
      dropped = true;
    }
  }
  return absl::OkStatus();
}

// Whether `v` lies on the way from a to b, at most 1/6 of its length aside.
bool OnSegment(const Vector3d& a, const Vector3d& b, const Vector3d& v) {
  constexpr double kAside = 1.0 / 6, kEnd = 0.1;
  const double share = (v - a).dot(b - a) / (b - a).squaredNorm();
  return share > kEnd && share < 1 - kEnd &&
         (v - a - share * (b - a)).norm() < kAside * (b - a).norm();
}

// The two faces of an edge, and what they become when it is flipped: (p, s, r) and (q, r, s).
struct Flip {
  int f = -1, g = -1;
  int p = -1, q = -1;  // the ends of the edge, along the half-edge of f
  int r = -1, s = -1;  // the corners opposite to it in f and g
};

Flip FlipOf(const Eigen::Matrix3Xi& faces, const MeshTopology& topology, int edge) {
  const int a = topology.edge_vertices(0, edge), b = topology.edge_vertices(1, edge);
  Flip flip{topology.edge_faces(0, edge), topology.edge_faces(1, edge), a, b};
  if (flip.g < 0) return flip;
  flip.r = OppositeCorner(faces, flip.f, a, b);
  flip.s = OppositeCorner(faces, flip.g, a, b);
  for (int k = 0; k < 3; ++k) {
    if (faces(k, flip.f) == b && faces((k + 1) % 3, flip.f) == a) std::swap(flip.p, flip.q);
  }
  return flip;
}

// Whether an edge crosses a crease whose line joins the corners opposite to it.
bool CrossesCrease(const OrientedCloud& cloud, const PointIndex& index, const ControlMesh& mesh,
                   const std::vector<uint8_t>& sharp, bool tagged, const Flip& flip) {
  const auto at = [&](int v) { return Vector3d(mesh.vertices.col(v)); };
  const auto slips_in = [&](int v) { return sharp[v] && OnSegment(at(flip.p), at(flip.q), at(v)); };
  const auto [f, g, p, q, r, s] = flip;
  if (tagged ? !slips_in(r) && !slips_in(s) : !sharp[r] || !sharp[s]) return false;
  const Vector3d left = (at(s) - at(p)).cross(at(r) - at(p));
  const Vector3d right = (at(r) - at(q)).cross(at(s) - at(q));
  if (!(left.norm() > 0) || !(right.norm() > 0)) return false;
  if (tagged) {
    // The face of the vertex on the edge has no normal of its own.
    const Vector3d normal = FaceCross(mesh, slips_in(r) ? g : f);
    return left.dot(normal) > 0 && right.dot(normal) > 0;
  }
  const Vector3d between = FaceCross(mesh, f).normalized() + FaceCross(mesh, g).normalized();
  if (left.dot(between) <= 0 || right.dot(between) <= 0) return false;
  const FoldedEdge edge{at(r), at(s), {left.normalized(), right.normalized()}, {at(p), at(q)}};
  return ClassifyEdge(cloud, index, edge, nullptr).edge_class != EdgeClass::kSmooth;
}

// Flips edges that cross a crease, none beside a face that another one changed: so each is judged
// by the mesh as given. Returns how many.
absl::StatusOr<int> FlipAcross(const OrientedCloud& cloud, const PointIndex& index,
                               const MeshTopology& topology, const std::vector<uint8_t>& tags,
                               const RunContext& context, ControlMesh* mesh) {
  std::vector<uint8_t> sharp(topology.vertex_count, 0), touched(topology.face_count(), 0);
  std::vector<int> valence = topology.valence;
  std::set<std::pair<int, int>> edges;
  for (int e = 0; e < topology.edge_count(); ++e) {
    edges.emplace(topology.edge_vertices(0, e), topology.edge_vertices(1, e));
    if (!tags[e]) continue;
    for (int k = 0; k < 2; ++k) sharp[topology.edge_vertices(k, e)] = 1;
  }
  std::vector<uint8_t> crosses(static_cast<size_t>(topology.edge_count()), 0);
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(topology.edge_count(), kHeavyBlock, context, [&](int64_t begin, int64_t end) {
        for (int e = static_cast<int>(begin); e < end; ++e) {
          const Flip flip = FlipOf(mesh->faces, topology, e);
          crosses[e] = flip.g >= 0 && CrossesCrease(cloud, index, *mesh, sharp, tags[e] != 0, flip);
        }
      }));
  int flips = 0;
  for (int e = 0; e < topology.edge_count(); ++e) {
    if (!crosses[e]) continue;
    const auto [f, g, p, q, r, s] = FlipOf(mesh->faces, topology, e);
    if (touched[f] || touched[g] || valence[p] <= 4 || valence[q] <= 4) continue;
    if (edges.count({std::min(r, s), std::max(r, s)}) > 0) continue;
    mesh->faces.col(f) << p, s, r;
    mesh->faces.col(g) << q, r, s;
    touched[f] = touched[g] = 1;
    --valence[p], --valence[q], ++valence[r], ++valence[s];
    edges.erase({std::min(p, q), std::max(p, q)});
    edges.emplace(std::min(r, s), std::max(r, s));
    ++flips;
  }
  return flips;
}

bool KeepsFacesUpright(const ControlMesh& mesh, const std::vector<int>& faces, int vertex,
                       const Vector3d& moved) {
  for (int face : faces) {
    std::array<Vector3d, 3> corners;
    for (int k = 0; k < 3; ++k) {
      const int v = mesh.faces(k, face);
      corners[k] = v == vertex ? moved : Vector3d(mesh.vertices.col(v));
    }
    const Vector3d after = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    const Vector3d before = FaceCross(mesh, face);
    if (!(after.dot(before) > kLeastUpright * after.norm() * before.norm())) return false;
  }
  return true;
}

void MoveOntoCreases(const OrientedCloud& cloud, const PointIndex& index,
                     const MeshTopology& topology,
                     const std::vector<EdgeClassification>& judgements,
                     const std::vector<uint8_t>& tags, ControlMesh* mesh) {
  std::vector<Quadric> quadrics(static_cast<size_t>(topology.vertex_count));
  std::vector<double> reach(quadrics.size(), 0);
  for (int e = 0; e < topology.edge_count(); ++e) {
    if (!tags[e]) continue;
    for (int k = 0; k < 2; ++k) {
      const int v = topology.edge_vertices(k, e);
      for (int side = 0; side < 2; ++side) {
        const HingePlane tangent = judgements[e].planes->TangentAt(side, mesh->vertices.col(v));
        quadrics[v].AddPlane(tangent.normal, tangent.offset * tangent.normal, 1);
      }
      reach[v] = std::max(reach[v], 3 * judgements[e].planes->spacing);
    }
  }
  std::vector<std::vector<int>> faces(quadrics.size());
  for (int f = 0; f < topology.face_count(); ++f) {
    for (int k = 0; k < 3; ++k) faces[topology.faces(k, f)].push_back(f);
  }
  for (int v = 0; v < topology.vertex_count; ++v) {
    if (!(reach[v] > 0)) continue;
    const Vector3d from = mesh->vertices.col(v);
    quadrics[v].AddPoint(from, kStay);
    Vector3d way = quadrics[v].Minimum(from) - from;
    if (!way.allFinite()) continue;
    if (way.norm() > reach[v]) way *= reach[v] / way.norm();
    for (double share : {1.0, 0.5, 0.25}) {
      const Vector3d to = from + share * way;
      if (!KeepsFacesUpright(*mesh, faces[v], v, to) ||
          !HasSupport(cloud, index, to, kReachSpacings))
        continue;
      mesh->vertices.col(v) = to;
      break;
    }
  }
}

// The way of the crease along one of its edges from a vertex, as the sides meet there.
Vector3d WayOut(const TwoPlaneModel& planes, const Vector3d& from, const Vector3d& to) {
  const Vector3d chord = (to - from).normalized();
  const Vector3d way =
      planes.TangentAt(0, from).normal.cross(planes.TangentAt(1, from).normal).normalized();
  return way.dot(chord) < 0 ? Vector3d(-way) : way;
}

// Where a crease turns sharply between its two edges, more than the curvature of its sides says.
std::vector<int> TurningCorners(const ControlMesh& mesh, const MeshTopology& topology,
                                const std::vector<EdgeClassification>& judgements,
                                const std::vector<uint8_t>& tags) {
  std::vector<std::vector<int>> edges(static_cast<size_t>(topology.vertex_count));
  for (int e = 0; e < topology.edge_count(); ++e) {
    if (!tags[e]) continue;
    for (int k = 0; k < 2; ++k) edges[topology.edge_vertices(k, e)].push_back(e);
  }
  std::vector<int> corners;
  for (int v = 0; v < topology.vertex_count; ++v) {
    if (edges[v].size() != 2) continue;
    std::array<Vector3d, 2> chord, way;
    for (int k = 0; k < 2; ++k) {
      const int e = edges[v][k];
      const int a = topology.edge_vertices(0, e), b = topology.edge_vertices(1, e);
      const Vector3d from = mesh.vertices.col(v), to = mesh.vertices.col(a == v ? b : a);
      chord[k] = (to - from).normalized();
      way[k] = judgements[e].planes ? WayOut(*judgements[e].planes, from, to) : chord[k];
    }
    if (-chord[0].dot(chord[1]) < kCornerCosine && -way[0].dot(way[1]) < kCornerCosine) {
      corners.push_back(v);
    }
  }
  return corners;
}

}  // namespace

absl::Status TagCreases(const OrientedCloud& cloud, const PointIndex& index,
                        const RunContext& context, ControlMesh* mesh) {
  const ControlMesh given = *mesh;
  constexpr int kFlipRounds = 3;
  EarlierClassifications earlier;
  for (int round = 0;; ++round) {
    const int vertex_count = static_cast<int>(mesh->vertices.cols());
    RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                             BuildMeshTopology(mesh->faces, vertex_count));
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<EdgeClassification> judgements,
                             ClassifyEdges(cloud, index, *mesh, topology, earlier, context));
    std::vector<uint8_t> tags = Tags(topology, judgements);
    if (round < kFlipRounds) {
      MoveOntoCreases(cloud, index, topology, judgements, tags, mesh);
      RILIEVO_ASSIGN_OR_RETURN(const int flips,
                               FlipAcross(cloud, index, topology, tags, context, mesh));
      if (flips > 0) {
        for (int e = 0; e < topology.edge_count(); ++e) {
          if (!judgements[e].place) continue;
          earlier[{topology.edge_vertices(0, e), topology.edge_vertices(1, e)}] = judgements[e];
        }
        continue;
      }
    }
    OpenTriangles(topology, *mesh, &tags);
    RILIEVO_RETURN_IF_ERROR(DropPoorRuns(topology, judgements, mesh, &tags));
    if (mesh->creases.empty()) {
      *mesh = given;
    } else {
      mesh->creases = CreasesOf(topology, tags);
      mesh->corners = TurningCorners(*mesh, topology, judgements, tags);
    }
    return absl::OkStatus();
  }
}

}  // namespace rilievo
