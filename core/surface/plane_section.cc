#include "core/surface/plane_section.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>

#include "absl/status/status.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

// An edge that the plane crosses: its ends, the smaller number above.
uint64_t EdgeKey(int a, int b) {
  const auto [low, high] = std::minmax(a, b);
  return static_cast<uint64_t>(low) << 32 | static_cast<uint64_t>(high);
}

// The cut of a triangle, from edge to edge.
struct Segment {
  uint64_t from, to;
  bool used = false;
};

class Cutter {
 public:
  Cutter(const TriangleMesh& mesh, const Plane& plane) : mesh_(mesh), plane_(plane) {
    heights_ = (plane.normal.transpose() * mesh.vertices).array() - plane.offset;
  }

  PlaneSection Run() {
    for (Eigen::Index t = 0; t < mesh_.triangles.cols(); ++t) CutTriangle(t);
    std::unordered_map<uint64_t, int> ends;  // segments that end at each edge
    for (const Segment& segment : segments_) ++ends[segment.to];
    for (size_t s = 0; s < segments_.size(); ++s) starts_.emplace(segments_[s].from, s);
    // Open ones first: from edges where nothing ends.
    for (Segment& segment : segments_) {
      if (!segment.used && !ends.contains(segment.from)) Follow(segment);
    }
    for (Segment& segment : segments_) {
      if (!segment.used) Follow(segment);
    }
    section_.plane = plane_;
    Measure();
    return std::move(section_);
  }

 private:
  bool Above(int vertex) const { return heights_[vertex] >= 0; }

  void CutTriangle(Eigen::Index t) {
    const auto corners = mesh_.triangles.col(t);
    const bool above[3] = {Above(corners[0]), Above(corners[1]), Above(corners[2])};
    if (above[0] == above[1] && above[1] == above[2]) return;
    // The corner alone on its side; the segment leaves it on the left where it lies above.
    const int alone = above[0] == above[1] ? 2 : above[0] == above[2] ? 1 : 0;
    const int a = corners[alone], b = corners[(alone + 1) % 3], c = corners[(alone + 2) % 3];
    uint64_t from = EdgeKey(a, b), to = EdgeKey(a, c);
    if (!above[alone]) std::swap(from, to);
    segments_.push_back({from, to});
  }

  // The polyline from a segment on.
  void Follow(Segment& first) {
    std::vector<uint64_t> edges = {first.from};
    for (Segment* at = &first; at != nullptr;) {
      at->used = true;
      edges.push_back(at->to);
      const auto next = starts_.find(at->to);
      at = next == starts_.end() || segments_[next->second].used ? nullptr
                                                                 : &segments_[next->second];
    }
    SectionPolyline polyline;
    polyline.closed = edges.size() > 3 && edges.front() == edges.back();
    if (polyline.closed) edges.pop_back();
    polyline.points.resize(3, static_cast<Eigen::Index>(edges.size()));
    for (size_t i = 0; i < edges.size(); ++i) {
      polyline.points.col(static_cast<Eigen::Index>(i)) = PointOn(edges[i]);
    }
    section_.polylines.push_back(std::move(polyline));
  }

  Vector3d PointOn(uint64_t edge) const {
    const auto a = static_cast<int>(edge >> 32), b = static_cast<int>(edge & 0xffffffffu);
    const double share = heights_[a] / (heights_[a] - heights_[b]);
    return mesh_.vertices.col(a) + share * (mesh_.vertices.col(b) - mesh_.vertices.col(a));
  }

  void Measure() {
    bool closed = true;
    double twice_area = 0;
    for (const SectionPolyline& polyline : section_.polylines) {
      const Eigen::Index count = polyline.points.cols();
      const Vector3d first = polyline.points.col(0);
      for (Eigen::Index i = 0; i + !polyline.closed < count; ++i) {
        const Vector3d a = polyline.points.col(i), b = polyline.points.col((i + 1) % count);
        section_.length += (b - a).norm();
        twice_area += plane_.normal.dot((a - first).cross(b - first));
      }
      closed = closed && polyline.closed;
    }
    if (closed) section_.area = twice_area / 2;
  }

  const TriangleMesh& mesh_;
  const Plane& plane_;
  Eigen::RowVectorXd heights_;  // of the vertices above the plane
  std::vector<Segment> segments_;
  std::unordered_map<uint64_t, size_t> starts_;  // the segment that starts at an edge
  PlaneSection section_;
};

}  // namespace

PlaneAxes AxesOf(const Plane& plane) {
  PlaneAxes axes;
  axes.right = Vector3d::UnitZ().cross(plane.normal);
  constexpr double kHorizontal = 1e-9;  // sine of the angle
  if (axes.right.norm() < kHorizontal) axes.right = Vector3d::UnitX();
  axes.right -= axes.right.dot(plane.normal) * plane.normal;
  axes.right.normalize();
  axes.up = plane.normal.cross(axes.right);
  return axes;
}

absl::StatusOr<PlaneSection> CutByPlane(const TriangleMesh& mesh, const Vector3d& normal,
                                        double offset) {
  const double length = normal.norm();
  if (!(length > 0) || !std::isfinite(length) || !std::isfinite(offset)) {
    return absl::InvalidArgumentError(
        "the plane needs a finite normal that is not zero and a finite offset");
  }
  if (!mesh.vertices.allFinite()) {
    return absl::InvalidArgumentError("the mesh has a coordinate that is not finite");
  }
  return Cutter(mesh, Plane{normal / length, offset / length}).Run();
}

}  // namespace rilievo
