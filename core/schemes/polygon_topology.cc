#include "core/schemes/polygon_topology.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <unordered_map>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

absl::Status CheckFaces(const PolygonMesh& mesh) {
  if (mesh.face_count() == 0) return absl::InvalidArgumentError("the mesh has no faces");
  const auto vertices = static_cast<int>(mesh.vertices.cols());
  for (int f = 0; f < mesh.face_count(); ++f) {
    const std::span<const int> face = mesh.Face(f);
    if (face.size() < 3) {
      return absl::InvalidArgumentError(
          absl::StrCat("face ", f, " has ", face.size(), " corners; 3 or more are needed"));
    }
    std::vector<int> sorted(face.begin(), face.end());
    std::sort(sorted.begin(), sorted.end());
    if (sorted.front() < 0 || sorted.back() >= vertices) {
      return absl::InvalidArgumentError(absl::StrCat(
          "face ", f, " names vertex ", sorted.front() < 0 ? sorted.front() : sorted.back(),
          ", there are ", vertices));
    }
    const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
    if (twice != sorted.end()) {
      return absl::InvalidArgumentError(absl::StrCat("face ", f, " has vertex ", *twice, " twice"));
    }
  }
  return absl::OkStatus();
}

uint64_t DirectedKey(int from, int to) {
  return static_cast<uint64_t>(from) << 32 | static_cast<uint32_t>(to);
}

}  // namespace

absl::StatusOr<PolygonTopology> BuildPolygonTopology(const PolygonMesh& mesh) {
  RILIEVO_RETURN_IF_ERROR(CheckFaces(mesh));
  const size_t count = mesh.corners.size();
  PolygonTopology topology;
  topology.next.resize(count);
  topology.previous.resize(count);
  topology.face.resize(count);
  topology.twin.assign(count, -1);
  topology.edge.resize(count);
  topology.outgoing.assign(static_cast<size_t>(mesh.vertices.cols()), -1);
  std::vector<int> faces_at(topology.outgoing.size(), 0);
  std::unordered_map<uint64_t, int> by_ends;
  by_ends.reserve(count);
  for (int f = 0; f < mesh.face_count(); ++f) {
    const int first = mesh.begin[static_cast<size_t>(f)];
    const auto corners = static_cast<int>(mesh.Face(f).size());
    for (int k = 0; k < corners; ++k) {
      const int h = first + k, next = first + (k + 1) % corners;
      topology.next[static_cast<size_t>(h)] = next;
      topology.previous[static_cast<size_t>(next)] = h;
      topology.face[static_cast<size_t>(h)] = f;
      const int from = mesh.corners[static_cast<size_t>(h)],
                to = mesh.corners[static_cast<size_t>(next)];
      if (!by_ends.try_emplace(DirectedKey(from, to), h).second) {
        return absl::InvalidArgumentError(absl::StrCat(
            "the edge from vertex ", from, " to ", to,
            " belongs to two faces in this direction; at most two faces may meet at an edge, and "
            "all must be oriented alike"));
      }
      ++faces_at[static_cast<size_t>(from)];
    }
  }
  for (size_t h = 0; h < count; ++h) {
    const int from = mesh.corners[h], to = mesh.corners[static_cast<size_t>(topology.next[h])];
    const auto across = by_ends.find(DirectedKey(to, from));
    const int twin = across == by_ends.end() ? -1 : across->second;
    topology.twin[h] = twin;
    if (twin >= 0 && twin < static_cast<int>(h)) {
      topology.edge[h] = topology.edge[static_cast<size_t>(twin)];
    } else {
      topology.edge[h] = topology.edge_count();
      topology.edge_half_edges.push_back(static_cast<int>(h));
    }
    int& outgoing = topology.outgoing[static_cast<size_t>(from)];
    if (outgoing < 0 || twin < 0) outgoing = static_cast<int>(h);
  }
  for (size_t v = 0; v < faces_at.size(); ++v) {
    if (faces_at[v] == 0) {
      return absl::InvalidArgumentError(absl::StrCat("vertex ", v, " belongs to no face"));
    }
    if (topology.Ring(static_cast<int>(v)).size() != static_cast<size_t>(faces_at[v])) {
      return absl::InvalidArgumentError(
          absl::StrCat("the faces at vertex ", v, " hang together in that point only"));
    }
  }
  return topology;
}

}  // namespace rilievo
