// The control points around a face, on its own side of creases and boundaries.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/evaluate/quartic_patch.h"
#include "core/geometry/mesh_topology.h"
#include "core/loop/crease_topology.h"

namespace rilievo {

// One level of a Loop surface with its tags.
struct TaggedLevel {
  MeshTopology topology;
  Eigen::Matrix3Xd points;        // column = vertex, subdivided up to this level
  std::vector<SharpEdge> tagged;  // inner edges, ascending
  std::vector<int> corners;       // vertices listed as corners, ascending
  std::vector<float> sharpness;   // of each edge; boundary edges have kInfiniteSharpness
  std::vector<VertexKind> kinds;  // of each vertex, by the edges that stay sharp
  std::vector<uint8_t> one_side;  // of each vertex: fewer than two edges stay sharp
  std::vector<uint8_t> settled;   // of each vertex: none of its edges is semi-sharp

  // All of it from the first four.
  static TaggedLevel Of(MeshTopology topology, Eigen::Matrix3Xd points,
                        std::vector<SharpEdge> tagged, std::vector<int> corners);
};

// The neighbours of a corner of a face, counter-clockwise: all of them where at most one edge is
// sharp, else those from sharp edge to sharp edge on the side of the face.
struct FaceStar {
  bool closed = false;
  std::vector<int> ring;
  int place = 0;         // the face lies between ring[place] and the next one
  int sharp_spoke = -1;  // of a closed star: the place of its sharp edge, if there is one
};
FaceStar StarOf(const TaggedLevel& level, int face, int corner);

// Whether the surface on the face follows the regular rules at this corner: an inner vertex of
// valence 6 without sharp edges, or a vertex on a crease or boundary that has three faces on this
// side of it.
bool IsRegularCorner(const TaggedLevel& level, int face, int corner);

// The six points around a regular corner from the face's next corner on. Beyond a sharp edge (a, b)
// of a face (a, b, c) there is a + b - c: with it the regular rules give those of the crease.
std::array<Eigen::Vector3d, 6> RegularStar(const TaggedLevel& level, int face, int corner);

// Of a face whose corners are all regular.
RegularRing RingOf(const TaggedLevel& level, int face);

}  // namespace rilievo
