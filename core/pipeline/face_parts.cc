#include "core/pipeline/face_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

#include "core/loop/face_vertices.h"
#include "core/pipeline/page_runs.h"
#include "core/pipeline/settings.h"

namespace rilievo {
namespace {

using Box = Eigen::AlignedBox3d;

// By face: the other half of its quad; itself where it is a triangle.
std::vector<int> OtherHalves(const PartCutter& cutter) {
  const MeshTopology& topology = cutter.topology();
  std::vector<int> other(topology.face_count());
  std::iota(other.begin(), other.end(), 0);
  for (int e = 0; e < static_cast<int>(cutter.diagonal().size()); ++e) {
    if (cutter.diagonal()[e] == 0) continue;
    const int a = topology.edge_faces(0, e), b = topology.edge_faces(1, e);
    other[a] = b, other[b] = a;
  }
  return other;
}

// The limit surface of a triangle or a quad lies in the convex hull of the control points of the
// triangles or quads that touch it; heights add what the coarse ones show.
std::vector<Box> ReachOfFaces(const PartCutter& cutter, const DisplacedSurface& coarse) {
  const MeshTopology& topology = cutter.topology();
  const std::vector<int> other = OtherHalves(cutter);
  std::vector<Box> around(topology.vertex_count);
  for (int f = 0; f < topology.face_count(); ++f) {
    Box whole;
    for (const int half : {f, other[f]}) {
      for (const int v : topology.faces.col(half)) {
        whole.extend(coarse.control_mesh.vertices.col(v));
      }
    }
    for (const int v : topology.faces.col(f)) around[v].extend(whole);
  }
  std::vector<Box> reach(topology.face_count());
  const FaceVertices vertices(topology, coarse.max_level);
  std::vector<int> of_face;
  for (int f = 0; f < topology.face_count(); ++f) {
    vertices.Of(f, of_face);
    double highest = 0;
    for (const int v : of_face) highest = std::max(highest, std::abs(double{coarse.heights[v]}));
    for (const int half : {f, other[f]}) {
      for (const int v : topology.faces.col(half)) reach[f].extend(around[v]);
    }
    reach[f].min().array() -= highest;
    reach[f].max().array() += highest;
  }
  return reach;
}

Box InScan(const Box& box, const SpatialFrame& frame) {
  return Box(frame.ScanFromUnit(box.min()), frame.ScanFromUnit(box.max()));
}

// Halves control faces until each part has few enough points around it.
class Partition {
 public:
  Partition(const PagedScan& scan, const ScanSurface& coarse, const Eigen::Matrix3Xd& vertices,
            const MeshTopology& topology, const std::vector<Box>& reach, int64_t most)
      : scan_(scan),
        coarse_(coarse),
        vertices_(vertices),
        topology_(topology),
        reach_(reach),
        most_(most) {}

  std::vector<FacePart> Run() {
    std::vector<int> all(topology_.face_count());
    std::iota(all.begin(), all.end(), 0);
    const int64_t points = PointsOf(all);
    Split(std::move(all), points);
    return std::move(parts_);
  }

 private:
  int64_t PointsAround(const Box& box) const {
    int64_t points = 0;
    for (const Page& page : scan_.pages()) points += page.PointsNear(box);
    return points;
  }

  double MiddleOf(int face, int axis) const {
    const auto corners = topology_.faces.col(face);
    return vertices_(axis, corners[0]) + vertices_(axis, corners[1]) + vertices_(axis, corners[2]);
  }

  Box BoxOf(const std::vector<int>& members) const {
    Box box;
    for (const int f : members) box.extend(reach_[f]);
    const double halo = kPageRuns.part_halo * coarse_.cloud.median_spacing;
    box.min().array() -= halo;
    box.max().array() += halo;
    return box;
  }

  int64_t PointsOf(const std::vector<int>& members) const {
    return PointsAround(InScan(BoxOf(members), coarse_.frame));
  }

  // Both halves, across the longest extent of their box.
  std::array<std::vector<int>, 2> Halves(std::vector<int> members) const {
    Eigen::Index axis = 0;
    BoxOf(members).sizes().maxCoeff(&axis);
    const auto along = [&](int f) { return std::pair(MiddleOf(f, static_cast<int>(axis)), f); };
    std::sort(members.begin(), members.end(), [&](int a, int b) { return along(a) < along(b); });
    const auto half = members.begin() + static_cast<std::ptrdiff_t>(members.size() / 2);
    std::array<std::vector<int>, 2> halves = {std::vector<int>(members.begin(), half),
                                              std::vector<int>(half, members.end())};
    for (std::vector<int>& part : halves) std::sort(part.begin(), part.end());
    return halves;
  }

  void Split(std::vector<int> members, int64_t points) {
    if (members.size() > 1 && points > most_) {
      std::array<std::vector<int>, 2> halves = Halves(members);
      const std::array<int64_t, 2> of_half = {PointsOf(halves[0]), PointsOf(halves[1])};
      if (IsWorthHalving(points, std::max(of_half[0], of_half[1]))) {
        for (size_t side = 0; side < 2; ++side) Split(std::move(halves[side]), of_half[side]);
        return;
      }
    }
    const Box box = BoxOf(members);
    parts_.push_back({std::move(members), box});
  }

  const PagedScan& scan_;
  const ScanSurface& coarse_;
  const Eigen::Matrix3Xd& vertices_;
  const MeshTopology& topology_;
  const std::vector<Box>& reach_;
  int64_t most_;
  std::vector<FacePart> parts_;
};

}  // namespace

FaceParts::FaceParts(const PagedScan& scan, const ScanSurface& coarse,
                     const DisplacedSurface& surface, const PartCutter& cutter, int64_t most_points)
    : reach_(ReachOfFaces(cutter, surface)) {
  parts_ =
      Partition(scan, coarse, surface.control_mesh.vertices, cutter.topology(), reach_, most_points)
          .Run();
}

std::vector<int> FaceParts::FacesIn(const Box& box) const {
  std::vector<int> within;
  for (int f = 0; f < static_cast<int>(reach_.size()); ++f) {
    if (box.intersects(reach_[f])) within.push_back(f);
  }
  return within;
}

Box FaceParts::ReachOf(const std::vector<int>& faces) const {
  Box box;
  for (const int f : faces) box.extend(reach_[f]);
  return box;
}

}  // namespace rilievo
