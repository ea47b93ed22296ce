#include "core/control/topology/bridge_gaps.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/control/topology/grow_faces.h"
#include "core/control/topology/settings.h"
#include "core/geometry/connected_parts.h"
#include "core/geometry/half_edges.h"
#include "core/geometry/mesh_topology.h"
#include "core/surface/closest_point_tree.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

// Where a vertex lies on the borders.
struct RimPlace {
  int loop = -1, at = 0;
};

// The border of each piece, and what lies next to it on others.
class FacingRims {
 public:
  static absl::StatusOr<FacingRims> Find(const ControlMesh& mesh, const MeshTopology& topology,
                                         double widest, const RunContext& context) {
    FacingRims rims;
    rims.loops_ = BoundaryLoops(topology);
    rims.place_.resize(static_cast<size_t>(topology.vertex_count));
    for (size_t l = 0; l < rims.loops_.size(); ++l) {
      for (size_t i = 0; i < rims.loops_[l].size(); ++i) {
        rims.place_[rims.loops_[l][i]] = {static_cast<int>(l), static_cast<int>(i)};
      }
    }
    rims.partner_.assign(static_cast<size_t>(topology.vertex_count), -1);
    RILIEVO_RETURN_IF_ERROR(rims.FindPartners(mesh, topology, widest, context));
    return rims;
  }

  const std::vector<std::vector<int>>& loops() const { return loops_; }
  RimPlace place(int v) const { return place_[v]; }
  int partner(int v) const { return partner_[v]; }

 private:
  // By vertex.
  static std::vector<int> PieceOf(const MeshTopology& topology, int* pieces) {
    const std::vector<uint8_t> all(static_cast<size_t>(topology.face_count()), 1);
    const std::vector<int> of_face = ConnectedParts(
        all, [&](int f) { return topology.face_neighbors.col(f); }, pieces);
    std::vector<int> piece(static_cast<size_t>(topology.vertex_count), -1);
    for (int f = 0; f < topology.face_count(); ++f) {
      for (const int v : topology.faces.col(f)) piece[v] = of_face[f];
    }
    return piece;
  }

  // The borders of one piece.
  struct PieceRims {
    std::vector<int> loops;
    Eigen::AlignedBox3d box;
  };

  // Of each vertex of a border the nearer end of the edge of another piece's border that is
  // nearest, unless that is too far.
  absl::Status FindPartners(const ControlMesh& mesh, const MeshTopology& topology, double widest,
                            const RunContext& context) {
    int count = 0;
    const std::vector<int> piece = PieceOf(topology, &count);
    std::vector<PieceRims> pieces(static_cast<size_t>(count));
    for (size_t l = 0; l < loops_.size(); ++l) {
      PieceRims& rims = pieces[piece[loops_[l][0]]];
      rims.loops.push_back(static_cast<int>(l));
      for (const int v : loops_[l]) rims.box.extend(mesh.vertices.col(v));
    }
    std::erase_if(pieces, [](const PieceRims& rims) { return rims.loops.empty(); });
    std::sort(pieces.begin(), pieces.end(), [](const PieceRims& a, const PieceRims& b) {
      return a.box.min().x() < b.box.min().x();
    });
    std::vector<double> least(partner_.size(), widest * widest);
    // Those farther along x are looked at while they may be near.
    for (size_t i = 0; i < pieces.size(); ++i) {
      for (size_t j = i + 1; j < pieces.size(); ++j) {
        if (pieces[j].box.min().x() >= pieces[i].box.max().x() + widest) break;
        if (pieces[i].box.squaredExteriorDistance(pieces[j].box) >= widest * widest) continue;
        RILIEVO_RETURN_IF_ERROR(Compare(mesh, pieces[i], pieces[j], context, &least));
        RILIEVO_RETURN_IF_ERROR(Compare(mesh, pieces[j], pieces[i], context, &least));
      }
    }
    return absl::OkStatus();
  }

  // `least`: squared distances of the partners found so far.
  absl::Status Compare(const ControlMesh& mesh, const PieceRims& queries, const PieceRims& found,
                       const RunContext& context, std::vector<double>* least) {
    std::vector<int> ends;                  // of edges, those of a loop after each other
    std::vector<Eigen::Vector3i> segments;  // the second end twice
    for (const int l : found.loops) {
      const auto begin = static_cast<int>(ends.size()), count = static_cast<int>(loops_[l].size());
      ends.insert(ends.end(), loops_[l].begin(), loops_[l].end());
      for (int i = 0; i < count; ++i) {
        const int next = begin + (i + 1) % count;
        segments.emplace_back(begin + i, next, next);
      }
    }
    Eigen::Matrix3Xi edges(3, static_cast<Eigen::Index>(segments.size()));
    for (size_t i = 0; i < segments.size(); ++i) {
      edges.col(static_cast<Eigen::Index>(i)) = segments[i];
    }
    const Eigen::Matrix3Xd places = mesh.vertices(Eigen::all, ends);
    RILIEVO_ASSIGN_OR_RETURN(const ClosestPointTree tree,
                             ClosestPointTree::Build(places, edges, context));
    for (const int l : queries.loops) {
      int hint = -1;
      for (const int v : loops_[l]) {
        const Vector3d place = mesh.vertices.col(v);
        const ClosestPointTree::Hit hit = tree.Closest(place, hint);
        hint = hit.item;
        if (hit.squared_distance >= (*least)[v]) continue;
        (*least)[v] = hit.squared_distance;
        const auto edge = edges.col(tree.source()[hit.item]);
        const int from = ends[edge[0]], to = ends[edge[1]];
        const bool is_nearer = (place - mesh.vertices.col(from)).squaredNorm() <=
                               (place - mesh.vertices.col(to)).squaredNorm();
        partner_[v] = is_nearer ? from : to;
      }
    }
    return absl::OkStatus();
  }

  std::vector<std::vector<int>> loops_;
  std::vector<RimPlace> place_;  // by vertex
  std::vector<int> partner_;     // by vertex; -1: none
};

// Vertices of two borders that run beside each other, the second against the way of its border; of
// whole loops the first vertex comes last again.
struct Band {
  std::vector<int> first, second;
};

double LengthOf(const std::vector<int>& way, const Eigen::Matrix3Xd& vertices) {
  double length = 0;
  for (size_t i = 1; i < way.size(); ++i) {
    length += (vertices.col(way[i]) - vertices.col(way[i - 1])).norm();
  }
  return length;
}

// From `begin` to `end` along a loop, forward or back; all of it where they are one and `whole`.
std::vector<int> WayAlong(const std::vector<int>& loop, int begin, int end, int step, bool whole) {
  const auto count = static_cast<int>(loop.size());
  std::vector<int> way = {loop[begin]};
  int at = begin;
  while (at != end || (whole && way.size() == 1)) {
    at = (at + step + count) % count;
    way.push_back(loop[at]);
  }
  return way;
}

// How far partners go along their loop, whose length is `count`, as one goes along `way`: each step
// the shorter way round.
int StepsOfPartners(const std::vector<int>& way, const FacingRims& rims, int count) {
  int sum = 0;
  for (size_t i = 1; i < way.size(); ++i) {
    const int step = rims.place(rims.partner(way[i])).at - rims.place(rims.partner(way[i - 1])).at;
    sum += step - count * static_cast<int>(std::lround(static_cast<double>(step) / count));
  }
  return sum;
}

// The stretches of a loop whose vertices all have partners on one other loop, as bands.
std::vector<Band> BandsOf(int loop, const FacingRims& rims, const Eigen::Matrix3Xd& vertices,
                          double widest) {
  const std::vector<int>& own = rims.loops()[loop];
  const auto count = static_cast<int>(own.size());
  const auto other = [&](int i) {
    const int partner = rims.partner(own[i % count]);
    return partner < 0 ? -1 : rims.place(partner).loop;
  };
  // Whether a border leaves the other one at its place `i`: from the next on they run together.
  const auto turns_away = [&](int i, int next) {
    const int v = own[i % count], w = own[next % count], partner = rims.partner(v);
    return partner == rims.partner(w) &&
           (vertices.col(w) - vertices.col(partner)).squaredNorm() <
               (vertices.col(v) - vertices.col(partner)).squaredNorm();
  };
  int start = 0;  // where a stretch begins
  while (start < count && other(start) == other(start + count - 1)) ++start;
  std::vector<Band> bands;
  if (start == count) {
    if (other(0) <= loop) return bands;
    // Around both loops, from where they are nearest.
    int nearest = 0;
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < count; ++i) {
      const double squared =
          (vertices.col(own[i]) - vertices.col(rims.partner(own[i]))).squaredNorm();
      if (squared < least) std::tie(least, nearest) = std::pair(squared, i);
    }
    const int from = rims.place(rims.partner(own[nearest])).at;
    bands.push_back({WayAlong(own, nearest, nearest, 1, true),
                     WayAlong(rims.loops()[other(0)], from, from, -1, true)});
  } else {
    for (int i = start; i < start + count;) {
      int end = i + 1;
      while (end < start + count && other(end) == other(i)) ++end;
      if (other(i) > loop) {
        int first = i, last = end - 1;
        while (first < last && turns_away(first, first + 1)) ++first;
        while (last > first && turns_away(last, last - 1)) --last;
        const int from = rims.place(rims.partner(own[first % count])).at;
        const int to = rims.place(rims.partner(own[last % count])).at;
        bands.push_back({WayAlong(own, first % count, last % count, 1, false),
                         WayAlong(rims.loops()[other(i)], from, to, -1, false)});
      }
      i = end;
    }
  }
  std::erase_if(bands, [&](const Band& band) {
    // A vertex alone would have two fans.
    if (std::min(band.first.size(), band.second.size()) < 2) return true;
    // Of pieces that face the same side the borders run against each other.
    const auto steps = static_cast<int>(band.second.size()) - 1;
    const std::vector<int>& facing = rims.loops()[rims.place(band.second[0]).loop];
    if (StepsOfPartners(band.first, rims, static_cast<int>(facing.size())) != -steps) return true;
    const double first = LengthOf(band.first, vertices), second = LengthOf(band.second, vertices);
    return second > kBridgeGaps.most_stretch * first + widest ||
           first > kBridgeGaps.most_stretch * second + widest;
  });
  return bands;
}

// The triangles of least area between both ways, each over an edge of one way and to a vertex of
// the other.
void Stitch(std::vector<int> first, std::vector<int> second, const Eigen::Matrix3Xd& vertices,
            std::vector<std::array<int, 3>>* triangles) {
  if (std::min(first.size(), second.size()) > kBridgeGaps.most_stitched) {
    const size_t middle = first.size() / 2;
    size_t opposite = second.size() / 2;
    double least = std::numeric_limits<double>::infinity();
    for (size_t j = second.size() / 4; j <= 3 * second.size() / 4; ++j) {
      const double squared = (vertices.col(first[middle]) - vertices.col(second[j])).squaredNorm();
      if (squared < least) std::tie(least, opposite) = std::pair(squared, j);
    }
    Stitch({first.begin(), first.begin() + middle + 1},
           {second.begin(), second.begin() + opposite + 1}, vertices, triangles);
    Stitch({first.begin() + middle, first.end()}, {second.begin() + opposite, second.end()},
           vertices, triangles);
    return;
  }
  const auto rows = static_cast<int>(first.size()), columns = static_cast<int>(second.size());
  // Of a triangle, and of its chord from a to b.
  const auto cost = [&](int a, int b, int c) {
    const Vector3d chord = vertices.col(b) - vertices.col(a);
    return chord.cross(vertices.col(c) - vertices.col(a)).norm() / 2 +
           kGrowFaces.short_chords * chord.squaredNorm();
  };
  // Least cost up to a chord from first[i] to second[j], and whether its last step is on `first`.
  std::vector<double> least(static_cast<size_t>(rows) * columns, 0);
  std::vector<uint8_t> on_first(least.size(), 0);
  const auto place = [&](int i, int j) { return static_cast<size_t>(i) * columns + j; };
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      if (i + j == 0) continue;
      const double infinity = std::numeric_limits<double>::infinity();
      const double by_first =
          i > 0 ? least[place(i - 1, j)] + cost(first[i], second[j], first[i - 1]) : infinity;
      const double by_second =
          j > 0 ? least[place(i, j - 1)] + cost(first[i], second[j], second[j - 1]) : infinity;
      on_first[place(i, j)] = by_first <= by_second;
      least[place(i, j)] = std::min(by_first, by_second);
    }
  }
  for (int i = rows - 1, j = columns - 1; i + j > 0;) {
    if (on_first[place(i, j)] != 0) {
      triangles->push_back({first[i], first[i - 1], second[j]});
      --i;
    } else {
      triangles->push_back({second[j - 1], second[j], first[i]});
      --j;
    }
  }
}

}  // namespace

absl::StatusOr<ControlMesh> BridgeGaps(ControlMesh mesh, double widest, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                           BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())));
  RILIEVO_ASSIGN_OR_RETURN(const FacingRims rims,
                           FacingRims::Find(mesh, topology, widest, context));
  GrownFaces grown;
  std::set<std::pair<int, int>> used;  // edges of rims, and chords
  for (size_t l = 0; l < rims.loops().size(); ++l) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    for (const Band& band : BandsOf(static_cast<int>(l), rims, mesh.vertices, widest)) {
      std::vector<std::pair<int, int>> edges;
      for (const auto* way : {&band.first, &band.second}) {
        for (size_t i = 1; i < way->size(); ++i) {
          edges.push_back(std::minmax((*way)[i - 1], (*way)[i]));
        }
      }
      const auto rim_edges = static_cast<std::ptrdiff_t>(edges.size());
      std::vector<std::array<int, 3>> triangles;
      Stitch(band.first, band.second, mesh.vertices, &triangles);
      for (const auto& corners : triangles) {
        for (int k = 0; k < 3; ++k) {
          edges.push_back(std::minmax(corners[k], corners[kNextCorner[k]]));
        }
      }
      // An edge between two bands would have three faces, or two fans at its ends.
      if (std::any_of(edges.begin(), edges.end(),
                      [&](const auto& e) { return used.contains(e); })) {
        continue;
      }
      grown.triangles.insert(grown.triangles.end(), triangles.begin(), triangles.end());
      grown.rims.insert(grown.rims.end(), edges.begin(), edges.begin() + rim_edges);
      used.insert(edges.begin(), edges.end());
    }
  }
  return GrowFaces(std::move(mesh), topology.vertex_count, grown, context);
}

}  // namespace rilievo
