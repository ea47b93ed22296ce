// The creases of a control mesh: tags checked, kinds of vertices, chains of tagged edges.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// What the sharp edges at a vertex make of it (Hoppe et al. 1994, section 3.2): none smooth, one
// dart, two crease, three or more corner. Sharp are tagged edges of any sharpness and all boundary
// edges, so a boundary vertex is a crease vertex, and a corner where a crease ends there. A vertex
// listed in ControlMesh::corners is a corner whatever its edges.
enum class VertexKind : uint8_t { kSmooth, kDart, kCrease, kCorner };

// An interior edge of positive sharpness.
struct SharpEdge {
  int edge;         // number in the topology
  float sharpness;  // in (0, kInfiniteSharpness]
  friend bool operator==(const SharpEdge&, const SharpEdge&) = default;
};

// Tags in any order as BuildCreaseTopology() takes them: what is tagged twice is tagged.
void SortTags(std::vector<Crease>* creases, std::vector<int>* corners);

// The edges whose flag is set, as creases.
std::vector<Crease> TaggedEdges(const MeshTopology& topology, const std::vector<uint8_t>& flags);

struct CreaseTopology {
  std::vector<SharpEdge> edges;   // ascending; a tag on a boundary edge changes nothing
  std::vector<VertexKind> kinds;  // one a vertex
};

// INVALID_ARGUMENT that names the crease or corner unless each crease is an edge of the mesh with
// a < b and a positive sharpness and not a diagonal, each corner a vertex, both strictly ascending.
// `topology`: of mesh.faces.
absl::StatusOr<CreaseTopology> BuildCreaseTopology(const ControlMesh& mesh,
                                                   const MeshTopology& topology);

// A run of tagged interior edges through vertices that only these two edges make sharp. It ends at
// vertices of other kinds (dart, corner), which are then its first and last vertex, or closes.
struct CreaseChain {
  std::vector<int> vertices;  // consecutive ones are joined by a tagged edge
  std::vector<int> edges;  // edges[i] joins vertices[i] and [i + 1]; closed: the last one and [0]
  bool closed = false;
};

// Every tagged interior edge is in exactly one chain. Chains are ordered, and a closed one starts,
// by their smallest edge number; an open one starts at its end of smaller vertex number (a chain
// from a corner back to itself is open).
std::vector<CreaseChain> CreaseChains(const MeshTopology& topology, const CreaseTopology& creases);

}  // namespace rilievo
