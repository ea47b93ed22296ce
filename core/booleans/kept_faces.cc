#include "core/booleans/kept_faces.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <span>
#include <tuple>
#include <utility>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/booleans/refine_cut.h"

namespace rilievo {
namespace {

// A face with no more has no fan worth a point in its middle.
constexpr size_t kFewNodes = 8;

// Of the line in which two faces cut each other. It runs along the normal of face[1] times that of
// face[0], so that on face[0] what is outside of solid 1 lies on its left.
struct CutEnd {
  std::array<int, 2> face;  // by side
  bool is_tip;
  int node;
};
struct CutLine {
  std::array<int, 2> face;
  int tail, tip;
};

struct Arc {
  int from, to;
  bool operator<(const Arc& other) const { return from < other.from; }
};

absl::Status Tangled() {
  return absl::FailedPreconditionError(
      "one of the shapes overlaps itself where the other cuts it; measure and mend it, or make it "
      "anew with another --max-error");
}

class FaceKeeper {
 public:
  FaceKeeper(const std::array<GridSolid, 2>& solids, const SolidCrossings& crossings,
             const KeptOutside& outside)
      : solids_(solids), crossings_(crossings), outside_(outside) {
    first_crossing_node_ = static_cast<int>(solids[0].points.size() + solids[1].points.size());
    for (size_t side = 0; side < 2; ++side) {
      begin_of_edge_[side].assign(solids[side].partner.size(), -1);
    }
    for (size_t i = crossings.all.size(); i-- > 0;) {
      const Crossing& crossing = crossings.all[i];
      begin_of_edge_[crossing.side][crossing.half_edge] = static_cast<int>(i);
    }
  }

  absl::StatusOr<KeptFaces> Keep(const RunContext& context) {
    RILIEVO_ASSIGN_OR_RETURN(std::vector<CutLine> lines, CutLines());
    KeptFaces kept;
    int diagonals = 0;
    for (size_t side = 0; side < 2; ++side) {
      std::stable_sort(lines.begin(), lines.end(), [&](const CutLine& a, const CutLine& b) {
        return a.face[side] < b.face[side];
      });
      RILIEVO_RETURN_IF_ERROR(KeepSide(side, lines, context, &diagonals, &kept));
    }
    return kept;
  }

 private:
  int NodeOf(size_t side, int vertex) const {
    return vertex + (side == 0 ? 0 : static_cast<int>(solids_[0].points.size()));
  }

  absl::StatusOr<std::vector<CutLine>> CutLines() const {
    std::vector<CutEnd> ends;
    ends.reserve(2 * crossings_.all.size());
    for (size_t i = 0; i < crossings_.all.size(); ++i) {
      const Crossing& crossing = crossings_.all[i];
      const uint32_t half_edges[2] = {crossing.half_edge,
                                      solids_[crossing.side].partner[crossing.half_edge]};
      for (const uint32_t h : half_edges) {
        const bool enters = crossing.enters == (h == half_edges[0]);
        CutEnd end{{}, enters == (crossing.side == 1), first_crossing_node_ + static_cast<int>(i)};
        end.face[crossing.side] = static_cast<int>(h / 3);
        end.face[1 - crossing.side] = crossing.face;
        ends.push_back(end);
      }
    }
    std::sort(ends.begin(), ends.end(), [](const CutEnd& a, const CutEnd& b) {
      return std::tie(a.face, a.is_tip, a.node) < std::tie(b.face, b.is_tip, b.node);
    });
    std::vector<CutLine> lines;
    for (size_t i = 0; i < ends.size(); i += 2) {
      const bool paired = i + 1 < ends.size() && ends[i].face == ends[i + 1].face &&
                          !ends[i].is_tip && ends[i + 1].is_tip &&
                          (i + 2 >= ends.size() || ends[i + 2].face != ends[i].face);
      if (!paired) return Tangled();
      lines.push_back({ends[i].face, ends[i].node, ends[i + 1].node});
    }
    return lines;
  }

  // Of grid steps.
  Eigen::Vector3d PlaceOf(int node) const {
    const auto of_first = static_cast<int>(solids_[0].points.size());
    if (node < of_first) return solids_[0].points[static_cast<size_t>(node)].position();
    if (node < first_crossing_node_) {
      return solids_[1].points[static_cast<size_t>(node - of_first)].position();
    }
    const Crossing& crossing = crossings_.all[static_cast<size_t>(node - first_crossing_node_)];
    const GridSolid& solid = solids_[crossing.side];
    const Eigen::Vector3d tail = solid.TailOf(crossing.half_edge).position();
    return tail + crossing.place.parameter() * (solid.TipOf(crossing.half_edge).position() - tail);
  }

  // What stays of the edge under half-edge h, in its direction. False where the other solid is
  // around a part of it more than once.
  bool AddEdge(size_t side, uint32_t h, std::vector<Arc>* arcs) const {
    const GridSolid& solid = solids_[side];
    const uint32_t owner = std::min(h, solid.partner[h]);
    const int tail = Origin(solid.faces, owner), tip = Origin(solid.faces, NextHalfEdge(owner));
    int winding = crossings_.windings[side][static_cast<size_t>(tail)], from = NodeOf(side, tail);
    const auto add = [&](int to) {
      if ((winding == 0) == outside_[side]) {
        arcs->push_back(owner == h ? Arc{from, to} : Arc{to, from});
      }
      from = to;
    };
    const int first = begin_of_edge_[side][owner];
    for (auto i = static_cast<size_t>(first); first >= 0 && i < crossings_.all.size(); ++i) {
      const Crossing& crossing = crossings_.all[i];
      if (crossing.side != side || crossing.half_edge != owner) break;
      add(first_crossing_node_ + static_cast<int>(i));
      winding += crossing.enters ? 1 : -1;
      if (winding < 0 || winding > 1) return false;
    }
    add(NodeOf(side, tip));
    return true;
  }

  // Cycles of arcs, each node of which is left once and reached once.
  static bool TraceLoops(std::vector<Arc> arcs, std::vector<std::vector<int>>* loops) {
    std::sort(arcs.begin(), arcs.end());
    for (size_t i = 1; i < arcs.size(); ++i) {
      if (arcs[i].from == arcs[i - 1].from) return false;
    }
    std::vector<uint8_t> used(arcs.size(), 0);
    for (size_t seed = 0; seed < arcs.size(); ++seed) {
      if (used[seed] != 0) continue;
      std::vector<int> loop;
      for (size_t at = seed;;) {
        used[at] = 1;
        loop.push_back(arcs[at].from);
        const auto next = std::lower_bound(arcs.begin(), arcs.end(), Arc{arcs[at].to, 0});
        if (next == arcs.end() || next->from != arcs[at].to) return false;
        at = static_cast<size_t>(next - arcs.begin());
        if (at == seed) break;
        if (used[at] != 0) return false;
      }
      if (loop.size() < 3) return false;
      loops->push_back(std::move(loop));
    }
    return true;
  }

  // Nodes seen from outside of the face, from its first corner: along two axes, which keeps what is
  // exact, and as they lie in the plane.
  struct FlatNodes {
    Eigen::Matrix2Xd along_axes, in_plane;
    Eigen::Matrix3d weights_of_place;  // of the corners of the face, from (x, y, 1) in the plane
  };
  FlatNodes Flat(size_t side, int face, const std::vector<int>& nodes) const {
    const GridTriangle corners = solids_[side].TriangleOf(face);
    const Eigen::Vector3d origin = corners[0].position();
    const Eigen::Vector3d normal =
        (corners[1].position() - origin).cross(corners[2].position() - origin);
    Eigen::Index axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    Eigen::Index x = (axis + 1) % 3, y = (axis + 2) % 3;
    if (normal[axis] < 0) std::swap(x, y);
    const Eigen::Vector3d right = (corners[1].position() - origin).normalized(),
                          up = normal.cross(right).normalized();
    const auto count = static_cast<Eigen::Index>(nodes.size());
    FlatNodes flat{Eigen::Matrix2Xd(2, count), Eigen::Matrix2Xd(2, count), {}};
    Eigen::Matrix3d places;
    for (Eigen::Index k = 0; k < 3; ++k) {
      const Eigen::Vector3d place = corners[static_cast<size_t>(k)].position() - origin;
      places.col(k) << place.dot(right), place.dot(up), 1;
    }
    flat.weights_of_place = places.inverse();
    for (Eigen::Index i = 0; i < count; ++i) {
      const Eigen::Vector3d place = PlaceOf(nodes[static_cast<size_t>(i)]) - origin;
      flat.along_axes.col(i) << place[x], place[y];
      flat.in_plane.col(i) << place.dot(right), place.dot(up);
    }
    return flat;
  }

  // Of a face: diagonals are numbered from 0, added points from -1 downward.
  struct CutPart {
    std::vector<CutTriangle> triangles;
    std::vector<AddedPoint> added;
  };
  bool CutFace(size_t side, std::span<const CutLine> lines, CutPart* part) const {
    const int face = lines[0].face[side];
    std::vector<Arc> arcs;
    for (const CutLine& line : lines) {
      const bool along = outside_[side] == (side == 0);
      arcs.push_back(along ? Arc{line.tail, line.tip} : Arc{line.tip, line.tail});
    }
    for (uint32_t k = 0; k < 3; ++k) {
      if (!AddEdge(side, 3 * static_cast<uint32_t>(face) + k, &arcs)) return false;
    }
    std::vector<std::vector<int>> loops;
    if (!TraceLoops(std::move(arcs), &loops)) return false;
    std::vector<int> nodes;
    for (std::vector<int>& loop : loops) {
      for (int& node : loop) {
        nodes.push_back(node);
        node = static_cast<int>(nodes.size()) - 1;
      }
    }
    const FlatNodes flat = Flat(side, face, nodes);
    part->triangles = CutLoops(flat.along_axes, loops);
    for (const Eigen::Vector2d& place :
         RefineCut(flat.in_plane, nodes.size() > kFewNodes, &part->triangles)) {
      AddedPoint point{{}, flat.weights_of_place * place.homogeneous()};
      for (size_t k = 0; k < 3; ++k) {
        point.corners[k] = NodeOf(side, solids_[side].faces(static_cast<Eigen::Index>(k), face));
      }
      part->added.push_back(point);
    }
    for (CutTriangle& triangle : part->triangles) {
      for (int& corner : triangle.corners) {
        const auto count = static_cast<int>(nodes.size());
        corner = corner < count ? nodes[static_cast<size_t>(corner)] : count - 1 - corner;
      }
    }
    return true;
  }

  // Appends it with the numbers of all faces.
  void Append(CutPart part, size_t side, int* diagonals, KeptFaces* kept) const {
    const int first_added = first_crossing_node_ + static_cast<int>(crossings_.all.size()) +
                            static_cast<int>(kept->added.size());
    kept->added.insert(kept->added.end(), part.added.begin(), part.added.end());
    int numbered = 0;
    for (CutTriangle& triangle : part.triangles) {
      for (int& corner : triangle.corners) corner = corner < 0 ? first_added - 1 - corner : corner;
      for (int& diagonal : triangle.diagonals) {
        if (diagonal < 0) continue;
        numbered = std::max(numbered, diagonal + 1);
        diagonal += *diagonals;
      }
      kept->triangles[side].push_back(triangle);
    }
    *diagonals += numbered;
  }

  absl::Status KeepSide(size_t side, const std::vector<CutLine>& lines, const RunContext& context,
                        int* diagonals, KeptFaces* kept) const {
    std::vector<size_t> begins;  // of the lines of each cut face
    for (size_t i = 0; i < lines.size(); ++i) {
      if (i == 0 || lines[i].face[side] != lines[i - 1].face[side]) begins.push_back(i);
    }
    const auto count = static_cast<int64_t>(begins.size());
    begins.push_back(lines.size());
    std::vector<CutPart> parts(static_cast<size_t>(count));
    std::vector<uint8_t> tangled(static_cast<size_t>(count), 0);
    RILIEVO_RETURN_IF_ERROR(
        ParallelFor(count, kHeavyBlock, context, [&](int64_t begin, int64_t end) {
          for (auto i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
            const auto lines_of_face =
                std::span(lines).subspan(begins[i], begins[i + 1] - begins[i]);
            tangled[i] = CutFace(side, lines_of_face, &parts[i]) ? 0 : 1;
          }
        }));
    if (std::find(tangled.begin(), tangled.end(), 1) != tangled.end()) return Tangled();
    kept->cut_faces += count;
    std::vector<CutTriangle>& triangles = kept->triangles[side];
    const GridSolid& solid = solids_[side];
    size_t next = 0;  // cut face
    for (int face = 0; face < solid.faces.cols(); ++face) {
      if (next < static_cast<size_t>(count) && lines[begins[next]].face[side] == face) {
        Append(std::move(parts[next++]), side, diagonals, kept);
        continue;
      }
      const int winding = crossings_.windings[side][static_cast<size_t>(solid.faces(0, face))];
      if ((winding == 0) != outside_[side]) continue;
      CutTriangle whole{{}, {-1, -1, -1}};
      for (size_t k = 0; k < 3; ++k) {
        whole.corners[k] = NodeOf(side, solid.faces(static_cast<Eigen::Index>(k), face));
      }
      triangles.push_back(whole);
    }
    return absl::OkStatus();
  }

  const std::array<GridSolid, 2>& solids_;
  const SolidCrossings& crossings_;
  const KeptOutside& outside_;
  int first_crossing_node_ = 0;
  std::array<std::vector<int>, 2> begin_of_edge_;  // by half-edge: its first crossing, or -1
};

}  // namespace

absl::StatusOr<KeptFaces> KeepFaces(const std::array<GridSolid, 2>& solids,
                                    const SolidCrossings& crossings, const KeptOutside& outside,
                                    const RunContext& context) {
  return FaceKeeper(solids, crossings, outside).Keep(context);
}

}  // namespace rilievo
