#include "core/codec/mesh/quad_coder.h"

#include <algorithm>
#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/codec/bytes/bit_models.h"
#include "core/codec/bytes/range_coder.h"

namespace rilievo {
namespace {

constexpr int kLengthClasses = 8;

int64_t SquaredLength(const MeshTopology& topology, const std::vector<GridPoint>& points,
                      int edge) {
  const GridPoint& a = points[topology.edge_vertices(0, edge)];
  const GridPoint& b = points[topology.edge_vertices(1, edge)];
  int64_t sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const int64_t difference = int64_t{a[axis]} - b[axis];
    sum += difference * difference;
  }
  return sum;
}

template <typename Coder>
class PairCoder {
 public:
  // `diagonal`: by edge; zero when decoding.
  PairCoder(Coder& coder, const MeshTopology& topology, const std::vector<GridPoint>& points,
            const ControlMesh& mesh, std::vector<uint8_t>& diagonal)
      : coder_(coder),
        topology_(topology),
        points_(points),
        creases_(mesh.creases),
        diagonal_(diagonal),
        paired_(topology.face_count(), 0) {}

  // The face that can be paired with none or is not half of one quad; -1 if all are.
  int Run() {
    for (int f = 0; f < topology_.face_count(); ++f) {
      if (paired_[f] == 0 && !PairFace(f)) return f;
    }
    return -1;
  }

 private:
  struct Candidate {
    int64_t length;
    int side;
  };

  bool IsCrease(int edge) const {
    const std::pair<int, int> ends = {topology_.edge_vertices(0, edge),
                                      topology_.edge_vertices(1, edge)};
    const auto at = std::lower_bound(creases_.begin(), creases_.end(), ends,
                                     [](const Crease& crease, const auto& pair) {
                                       return std::pair(crease.a, crease.b) < pair;
                                     });
    return at != creases_.end() && std::pair(at->a, at->b) == ends;
  }

  bool PairFace(int face) {
    std::array<Candidate, 3> candidates{};
    int count = 0;
    for (int side = 0; side < 3; ++side) {
      const int neighbor = topology_.face_neighbors(side, face);
      const int edge = topology_.face_edges(side, face);
      if (neighbor < 0 || paired_[neighbor] != 0 || IsCrease(edge)) continue;
      candidates[count++] = {SquaredLength(topology_, points_, edge), side};
    }
    std::stable_sort(candidates.begin(), candidates.begin() + count,
                     [](const Candidate& a, const Candidate& b) { return a.length > b.length; });
    for (int i = 0; i < count; ++i) {
      const int edge = topology_.face_edges(candidates[i].side, face);
      if (i + 1 < count && !CodeFlag(candidates, count, i, diagonal_[edge] != 0)) continue;
      if (!Coder::kDecodes && diagonal_[edge] == 0) return false;
      diagonal_[edge] = 1;
      paired_[face] = paired_[topology_.face_neighbors(candidates[i].side, face)] = 1;
      return true;
    }
    return false;
  }

  bool CodeFlag(const std::array<Candidate, 3>& candidates, int count, int i, bool flag) {
    // How much longer it is than the next one.
    const int64_t length = std::max<int64_t>(1, candidates[i].length);
    const auto longer = static_cast<int>(kLengthClasses * candidates[i + 1].length / length);
    const int place = 2 * (count - 2) + i;
    const std::array<BitModel*, 2> inputs = {&flags_[0][place],
                                             &flags_[1][place * (kLengthClasses + 1) + longer]};
    return mixer_.Code(coder_, flag, inputs, 255);
  }

  Coder& coder_;
  const MeshTopology& topology_;
  const std::vector<GridPoint>& points_;
  const std::vector<Crease>& creases_;
  std::vector<uint8_t>& diagonal_;
  std::vector<uint8_t> paired_;  // by face
  std::array<std::array<BitModel, 4 * (kLengthClasses + 1)>, 2> flags_;
  BitMixer<2> mixer_;
};

}  // namespace

absl::StatusOr<std::vector<uint8_t>> EncodeQuads(const ControlMesh& mesh,
                                                 const MeshTopology& topology,
                                                 const std::vector<GridPoint>& points) {
  std::vector<uint8_t> diagonal(topology.edge_count(), 0);
  size_t found = 0;
  for (int e = 0; e < topology.edge_count(); ++e) {
    const std::array<int, 2> ends = {topology.edge_vertices(0, e), topology.edge_vertices(1, e)};
    diagonal[e] = std::binary_search(mesh.diagonals.begin(), mesh.diagonals.end(), ends);
    found += diagonal[e];
  }
  RangeEncoder coder;
  const int face = PairCoder(coder, topology, points, mesh, diagonal).Run();
  if (face >= 0 || found != mesh.diagonals.size() ||
      2 * found != static_cast<size_t>(topology.face_count())) {
    return absl::InvalidArgumentError(
        absl::StrCat("the ", mesh.diagonals.size(), " diagonals do not pair up the ",
                     topology.face_count(), " faces of the control mesh across smooth edges"));
  }
  return coder.Finish();
}

absl::Status DecodeQuads(std::span<const uint8_t> bytes, const MeshTopology& topology,
                         const std::vector<GridPoint>& points, ControlMesh& mesh) {
  std::vector<uint8_t> diagonal(topology.edge_count(), 0);
  RangeDecoder coder(bytes);
  const int face = PairCoder(coder, topology, points, mesh, diagonal).Run();
  if (coder.overrun()) return absl::DataLossError("the quads end before their last one");
  if (face >= 0) {
    return absl::DataLossError(absl::StrCat("face ", face, " of the control mesh is in no quad"));
  }
  mesh.diagonals.clear();
  for (int e = 0; e < topology.edge_count(); ++e) {
    if (diagonal[e] == 0) continue;
    mesh.diagonals.push_back({topology.edge_vertices(0, e), topology.edge_vertices(1, e)});
  }
  std::sort(mesh.diagonals.begin(), mesh.diagonals.end());
  return absl::OkStatus();
}

}  // namespace rilievo
