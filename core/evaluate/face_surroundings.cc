#include "core/evaluate/face_surroundings.h"

#include <algorithm>
#include <utility>

#include "core/geometry/triangle_mesh.h"
#include "core/loop/edge_star.h"

namespace rilievo {
namespace {

constexpr int kFacesOfRegularSide = 3;

int CornerAt(const MeshTopology& topology, int face, int vertex) {
  return (topology.faces(1, face) == vertex) + 2 * (topology.faces(2, face) == vertex);
}

bool StaysSharp(float sharpness) { return sharpness >= kInfiniteSharpness; }

}  // namespace

TaggedLevel TaggedLevel::Of(MeshTopology topology, Eigen::Matrix3Xd points,
                            std::vector<SharpEdge> tagged, std::vector<int> corners) {
  TaggedLevel level;
  level.sharpness.assign(topology.edge_count(), 0.0f);
  for (const SharpEdge& edge : tagged) level.sharpness[edge.edge] = edge.sharpness;
  level.settled.assign(topology.vertex_count, 1);
  std::vector<int> sharp_edges(topology.vertex_count, 0);
  for (int e = 0; e < topology.edge_count(); ++e) {
    float& sharpness = level.sharpness[e];
    if (topology.edge_faces(1, e) < 0) sharpness = kInfiniteSharpness;
    if (sharpness <= 0) continue;
    for (int end = 0; end < 2; ++end) {
      const int v = topology.edge_vertices(end, e);
      if (StaysSharp(sharpness)) {
        ++sharp_edges[v];
      } else {
        level.settled[v] = 0;
      }
    }
  }
  level.kinds.resize(topology.vertex_count);
  level.one_side.resize(topology.vertex_count);
  for (int v = 0; v < topology.vertex_count; ++v) {
    level.kinds[v] = static_cast<VertexKind>(std::min(sharp_edges[v], 3));
    level.one_side[v] = sharp_edges[v] < 2;
  }
  for (int v : corners) level.kinds[v] = VertexKind::kCorner;
  level.topology = std::move(topology);
  level.points = std::move(points);
  level.tagged = std::move(tagged);
  level.corners = std::move(corners);
  return level;
}

FaceStar StarOf(const TaggedLevel& level, int face, int corner) {
  const MeshTopology& topology = level.topology;
  const int vertex = topology.faces(corner, face);
  const auto edge_sharp = [&](int side, int at) {
    return StaysSharp(level.sharpness[topology.face_edges(side, at)]);
  };
  FaceStar star;
  star.closed = level.one_side[vertex] != 0;
  star.ring.push_back(topology.faces(kNextCorner[corner], face));
  if (star.closed && edge_sharp(corner, face)) star.sharp_spoke = 0;
  for (int at = face, k = corner;;) {
    const int side = kPreviousCorner[k];  // the edge to the face's third vertex
    const bool sharp = edge_sharp(side, at);
    const int neighbor = topology.face_neighbors(side, at);
    if (star.closed && neighbor == face) break;
    star.ring.push_back(topology.faces(side, at));
    if (sharp && star.closed) star.sharp_spoke = static_cast<int>(star.ring.size()) - 1;
    if (sharp && !star.closed) break;
    at = neighbor;
    k = CornerAt(topology, at, vertex);
  }
  if (star.closed) return star;
  std::vector<int> before;
  for (int at = face, k = corner; !edge_sharp(k, at);) {
    at = topology.face_neighbors(k, at);
    k = CornerAt(topology, at, vertex);
    before.push_back(topology.faces(kNextCorner[k], at));
  }
  star.place = static_cast<int>(before.size());
  star.ring.insert(star.ring.begin(), before.rbegin(), before.rend());
  return star;
}

bool IsRegularCorner(const TaggedLevel& level, int face, int corner) {
  const int vertex = level.topology.faces(corner, face);
  if (level.settled[vertex] == 0) return false;
  if (level.kinds[vertex] == VertexKind::kSmooth) return level.topology.valence[vertex] == 6;
  if (level.kinds[vertex] != VertexKind::kCrease) return false;
  return StarOf(level, face, corner).ring.size() == kFacesOfRegularSide + 1;
}

std::array<Eigen::Vector3d, 6> RegularStar(const TaggedLevel& level, int face, int corner) {
  const MeshTopology& topology = level.topology;
  const int vertex = topology.faces(corner, face);
  std::array<Eigen::Vector3d, 6> around;
  if (level.one_side[vertex] != 0) {
    for (int i = 0, at = face, k = corner; i < 6; ++i) {
      around[i] = level.points.col(topology.faces(kNextCorner[k], at));
      at = topology.face_neighbors(kPreviousCorner[k], at);
      k = CornerAt(topology, at, vertex);
    }
    return around;
  }
  const FaceStar star = StarOf(level, face, corner);
  for (size_t i = 0; i < star.ring.size(); ++i) around[i] = level.points.col(star.ring[i]);
  const Eigen::Vector3d center = level.points.col(vertex);
  around[4] = center + around[3] - around[2];
  around[5] = center + around[0] - around[1];
  std::rotate(around.begin(), around.begin() + star.place, around.end());
  return around;
}

RegularRing RingOf(const TaggedLevel& level, int face) {
  RegularRing ring;
  for (int k = 0; k < 3; ++k) {
    const std::array<Eigen::Vector3d, 6> around = RegularStar(level, face, k);
    ring[k] = level.points.col(level.topology.faces(k, face));
    for (int i = 0; i < 3; ++i) ring[3 + 3 * k + i] = around[3 + i];
  }
  return ring;
}

}  // namespace rilievo
