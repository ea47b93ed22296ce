#include "core/codec/mesh/crease_coder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/bit_models.h"
#include "core/codec/bytes/range_coder.h"

namespace rilievo {
namespace {

constexpr int kSharpnessSteps = 16;
constexpr int kLargestSharpness = static_cast<int>(kInfiniteSharpness) * kSharpnessSteps;
constexpr int kSharpnessBits = 8;

// What is coded: 0 for an edge without a tag, else its sharpness in 1/16; 1 for a corner.
struct TagNumbers {
  std::vector<int> of_edge;
  std::vector<uint8_t> corner;
};

// Angle between the normals of an edge's faces, in 1/16 of a half turn; 17 on the boundary.
int FoldClass(const MeshTopology& topology, const std::vector<GridPoint>& points, int edge) {
  if (topology.edge_faces(1, edge) < 0) return 17;
  std::array<GridPoint, 2> normals;
  for (int side = 0; side < 2; ++side) {
    const Eigen::Vector3i face = topology.faces.col(topology.edge_faces(side, edge));
    const std::array<int64_t, 3> normal =
        GateNormal(points[face[0]], points[face[1]], points[face[2]]);
    for (int axis = 0; axis < 3; ++axis) {
      normals[side][axis] = static_cast<int32_t>(normal[axis] >> 3);
    }
  }
  return CornerAngle({0, 0, 0}, normals[0], normals[1]) / 128;
}

template <typename Coder>
class TagCoder {
 public:
  TagCoder(Coder& coder, const MeshTopology& topology, const std::vector<GridPoint>& points,
           TagNumbers& tags)
      : coder_(coder), topology_(topology), points_(points), tags_(tags) {
    tags_.of_edge.resize(topology.edge_count(), 0);
    tags_.corner.resize(topology.vertex_count, 0);
  }

  // False when a sharpness is none of the format.
  bool Run() {
    std::vector<int> tagged(topology_.vertex_count, 0);
    for (int e = 0; e < topology_.edge_count(); ++e) {
      const int a = topology_.edge_vertices(0, e), b = topology_.edge_vertices(1, e);
      if (!CodeEdge(e, std::min(2, tagged[a]) * 3 + std::min(2, tagged[b]))) return false;
      if (tags_.of_edge[e] == 0) continue;
      ++tagged[a];
      ++tagged[b];
    }
    const bool any = std::find(tags_.corner.begin(), tags_.corner.end(), 1) != tags_.corner.end();
    if (!coder_.Code(any, 32768)) return true;
    for (int v = 0; v < topology_.vertex_count; ++v) {
      const std::array<BitModel*, 1> input = {&corners_[std::min(3, tagged[v])]};
      tags_.corner[v] = corner_mixer_.Code(coder_, tags_.corner[v] != 0, input, 255) ? 1 : 0;
    }
    return true;
  }

 private:
  bool CodeEdge(int e, int ends) {
    const int fold = FoldClass(topology_, points_, e);
    const std::array<BitModel*, 3> inputs = {&flags_[0][fold], &flags_[1][ends],
                                             &flags_[2][fold / 2 * 9 + ends]};
    if (!flag_mixer_.Code(coder_, tags_.of_edge[e] != 0, inputs, 255)) return true;
    const std::array<BitModel*, 1> same = {&same_};
    if (same_mixer_.Code(coder_, tags_.of_edge[e] == last_, same, 255)) {
      tags_.of_edge[e] = last_;
      return true;
    }
    int sharpness = 0;
    for (int bit = kSharpnessBits - 1; bit >= 0; --bit) {
      sharpness = 2 * sharpness + (coder_.Code((tags_.of_edge[e] >> bit & 1) != 0, 32768) ? 1 : 0);
    }
    tags_.of_edge[e] = last_ = sharpness;
    return sharpness >= 1 && sharpness <= kLargestSharpness;
  }

  Coder& coder_;
  const MeshTopology& topology_;
  const std::vector<GridPoint>& points_;
  TagNumbers& tags_;
  int last_ = kLargestSharpness;
  std::array<std::array<BitModel, 81>, 3> flags_;
  BitMixer<3> flag_mixer_;
  BitModel same_;
  BitMixer<1> same_mixer_;
  std::array<BitModel, 4> corners_;
  BitMixer<1> corner_mixer_;
};

absl::StatusOr<TagNumbers> NumbersOf(const ControlMesh& mesh, const MeshTopology& topology) {
  TagNumbers tags;
  tags.of_edge.resize(topology.edge_count(), 0);
  tags.corner.resize(topology.vertex_count, 0);
  std::vector<std::pair<std::pair<int, int>, int>> edges;  // ends, number
  for (int e = 0; e < topology.edge_count(); ++e) {
    edges.push_back({{topology.edge_vertices(0, e), topology.edge_vertices(1, e)}, e});
  }
  std::sort(edges.begin(), edges.end());
  std::pair<int, int> last = {-1, -1};
  for (size_t i = 0; i < mesh.creases.size(); ++i) {
    const Crease& crease = mesh.creases[i];
    const std::pair<int, int> ends = {crease.a, crease.b};
    const auto found = std::lower_bound(edges.begin(), edges.end(), std::pair(ends, -1));
    if (found == edges.end() || found->first != ends || !(last < ends)) {
      return absl::InvalidArgumentError(absl::StrCat("crease ", i, " joins ", crease.a, " and ",
                                                     crease.b, ": no edge, or out of order"));
    }
    if (!(crease.sharpness > 0) || StoredSharpness(crease.sharpness) != crease.sharpness) {
      return absl::InvalidArgumentError(absl::StrCat("crease ", i, " has sharpness ",
                                                     crease.sharpness,
                                                     ", no 1/16 of the format: call "
                                                     "PrepareControlMesh"));
    }
    tags.of_edge[found->second] = static_cast<int>(crease.sharpness * kSharpnessSteps);
    last = ends;
  }
  int last_corner = -1;
  for (int corner : mesh.corners) {
    if (corner <= last_corner || corner >= topology.vertex_count) {
      return absl::InvalidArgumentError(
          absl::StrCat("corner ", corner, " is not a vertex, or out of order"));
    }
    tags.corner[corner] = 1;
    last_corner = corner;
  }
  return tags;
}

}  // namespace

float StoredSharpness(float sharpness) {
  if (!(sharpness < kInfiniteSharpness)) return kInfiniteSharpness;
  return std::max(1.0f, std::nearbyint(sharpness * kSharpnessSteps)) / kSharpnessSteps;
}

absl::StatusOr<std::vector<uint8_t>> EncodeCreases(const ControlMesh& mesh,
                                                   const MeshTopology& topology,
                                                   const std::vector<GridPoint>& points) {
  RILIEVO_ASSIGN_OR_RETURN(TagNumbers tags, NumbersOf(mesh, topology));
  RangeEncoder coder;
  TagCoder<RangeEncoder>(coder, topology, points, tags).Run();
  return coder.Finish();
}

absl::Status DecodeCreases(std::span<const uint8_t> bytes, const MeshTopology& topology,
                           const std::vector<GridPoint>& points, ControlMesh& mesh) {
  TagNumbers tags;
  RangeDecoder coder(bytes);
  if (!TagCoder<RangeDecoder>(coder, topology, points, tags).Run()) {
    return absl::DataLossError("a crease has a sharpness that the format does not have");
  }
  if (coder.overrun()) return absl::DataLossError("the crease tags end before their last one");
  mesh.creases.clear();
  mesh.corners.clear();
  for (int e = 0; e < topology.edge_count(); ++e) {
    if (tags.of_edge[e] == 0) continue;
    mesh.creases.push_back({topology.edge_vertices(0, e), topology.edge_vertices(1, e),
                            static_cast<float>(tags.of_edge[e]) / kSharpnessSteps});
  }
  std::sort(mesh.creases.begin(), mesh.creases.end(), [](const Crease& p, const Crease& q) {
    return std::pair(p.a, p.b) < std::pair(q.a, q.b);
  });
  for (int v = 0; v < topology.vertex_count; ++v) {
    if (tags.corner[v] != 0) mesh.corners.push_back(v);
  }
  return absl::OkStatus();
}

}  // namespace rilievo
