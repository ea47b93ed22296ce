#include "core/booleans/separate_contacts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/booleans/box_tree.h"
#include "core/booleans/solid_of_mesh.h"
#include "core/geometry/mesh_topology.h"

namespace rilievo {
namespace {

// Vertices that become one; the lowest stands for them all.
class VertexSets {
 public:
  explicit VertexSets(Eigen::Index count) : parent_(static_cast<size_t>(count)) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  int Find(int v) {
    while (At(v) != v) v = At(v) = At(At(v));
    return v;
  }
  void Unite(int a, int b) {
    a = Find(a), b = Find(b);
    At(std::max(a, b)) = std::min(a, b);
  }

 private:
  int& At(int v) { return parent_[static_cast<size_t>(v)]; }
  std::vector<int> parent_;
};

using Corners = std::array<int, 3>;

Eigen::Matrix3Xi ColumnsOf(const std::vector<Corners>& triangles) {
  Eigen::Matrix3Xi columns(3, static_cast<Eigen::Index>(triangles.size()));
  for (size_t t = 0; t < triangles.size(); ++t) {
    columns.col(static_cast<Eigen::Index>(t)) = Eigen::Vector3i(triangles[t].data());
  }
  return columns;
}

// Takes triangles that are thinner than `width` out of a mesh, so that the others still have the
// same border, that is none: the ends of a short edge become one, and an edge that a vertex lies on
// is cut there in all triangles around it.
class Thinner {
 public:
  Thinner(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& triangles,
          std::vector<uint8_t> near_contact, double width)
      : vertices_(vertices),
        width_(width),
        sets_(vertices.cols()),
        near_contact_(std::move(near_contact)) {
    near_contact_.resize(static_cast<size_t>(vertices.cols()), 0);
    for (const auto triangle : triangles.colwise()) {
      triangles_.push_back({triangle[0], triangle[1], triangle[2]});
    }
    cuts_left_ = 4 * kRounds * (triangles_.size() + 1000);
  }

  enum class Outcome { kUnchanged, kThinned, kGivenUp };
  // Given up where cuts breed cuts, as many vertices on one line may make them, or where it does
  // not come to rest.
  Outcome Run() {
    for (size_t round = 0; round < kRounds; ++round) {
      if (round > 0 && round % kRoundsOfWidth == 0) width_ *= 2;
      if (!JoinShortEdges() && !CutAtApexes() && !MatchSides()) {
        return round == 0 ? Outcome::kUnchanged : Outcome::kThinned;
      }
      if (cuts_left_ == 0) break;
    }
    return Outcome::kGivenUp;
  }

  Eigen::Matrix3Xi triangles() const { return ColumnsOf(triangles_); }

 private:
  // Each makes the longest edges of thin triangles shorter. Two vertices on one line that are
  // little farther apart than the width may cut each other's edges for ever, until the width joins
  // them.
  static constexpr size_t kRounds = 40, kRoundsOfWidth = 4;

  double Length(int a, int b) const { return (vertices_.col(a) - vertices_.col(b)).norm(); }
  static uint64_t KeyOf(int a, int b) {
    return static_cast<uint64_t>(std::min(a, b)) << 32 | static_cast<uint32_t>(std::max(a, b));
  }

  // Farther than a vertex lies from an edge that it cuts, so that no edge is cut into pieces as
  // short as it is far.
  bool AreOne(int a, int b) const { return Length(a, b) < 2 * width_; }

  // Makes one vertex of both.
  void Join(int a, int b) {
    sets_.Unite(a, b);
    near_contact_[static_cast<size_t>(a)] = near_contact_[static_cast<size_t>(b)] = 1;
    joins_ = true;
  }

  bool ApplyJoins() {
    if (!std::exchange(joins_, false)) return false;
    for (Corners& triangle : triangles_) {
      for (int& corner : triangle) corner = sets_.Find(corner);
    }
    std::erase_if(triangles_,
                  [](const Corners& c) { return c[0] == c[1] || c[1] == c[2] || c[2] == c[0]; });
    return true;
  }

  bool IsNear(int v) const { return near_contact_[static_cast<size_t>(v)] != 0; }
  bool IsNear(const Corners& c) const { return IsNear(c[0]) && IsNear(c[1]) && IsNear(c[2]); }

  bool JoinShortEdges() {
    for (const Corners& triangle : triangles_) {
      if (!IsNear(triangle)) continue;
      for (size_t k = 0; k < 3; ++k) {
        const int a = triangle[k], b = triangle[(k + 1) % 3];
        if (AreOne(a, b)) Join(a, b);
      }
    }
    return ApplyJoins();
  }

  bool CutEdges() {
    if (on_edge_.empty()) return false;
    std::vector<Corners> given;
    given.swap(triangles_);
    for (const Corners& triangle : given) Cut(triangle, 0);
    on_edge_.clear();
    return true;
  }

  // Of each thin triangle the vertex that lies on its longest edge.
  bool CutAtApexes() {
    for (const Corners& c : triangles_) {
      if (!IsNear(c)) continue;
      size_t longest = 0;
      double length = 0;
      for (size_t k = 0; k < 3; ++k) {
        const double other = Length(c[k], c[(k + 1) % 3]);
        if (other > length) {
          length = other;
          longest = k;
        }
      }
      const Eigen::Vector3d u = vertices_.col(c[1]) - vertices_.col(c[0]),
                            v = vertices_.col(c[2]) - vertices_.col(c[0]);
      if (u.cross(v).norm() >= width_ * length) continue;
      const int apex = c[(longest + 2) % 3];
      const auto [at, added] = on_edge_.emplace(KeyOf(c[longest], c[(longest + 1) % 3]), apex);
      if (!added) at->second = std::min(at->second, apex);
      for (const int corner : c) near_contact_[static_cast<size_t>(corner)] = 1;
    }
    return CutEdges();
  }

  bool LiesOn(int vertex, int a, int b) const {
    const Eigen::Vector3d along = vertices_.col(b) - vertices_.col(a),
                          to = vertices_.col(vertex) - vertices_.col(a);
    return to.dot(along) > 0 && to.dot(along) < along.squaredNorm() &&
           to.cross(along).norm() < width_ * along.norm();
  }

  FloatBox BoxAround(int a, int b) const {
    FloatBox box;
    for (int axis = 0; axis < 3; ++axis) {
      const auto [low, high] = std::minmax(vertices_(axis, a), vertices_(axis, b));
      box.lo[axis] = FloatBox::RoundDown(low - vertices_(axis, 0) - width_);
      box.hi[axis] = FloatBox::RoundUp(high - vertices_(axis, 0) + width_);
    }
    return box;
  }

  // A neck has two sides, which get the same vertices.
  bool MatchSides() {
    std::vector<std::array<int, 2>> edges;
    std::vector<int> vertices;
    for (const Corners& c : triangles_) {
      for (size_t k = 0; k < 3; ++k) {
        const int a = c[k], b = c[(k + 1) % 3];
        if (IsNear(a)) vertices.push_back(a);
        if (IsNear(a) || IsNear(b)) edges.push_back({std::min(a, b), std::max(a, b)});
      }
    }
    const auto each_once = [](auto* list) {
      std::sort(list->begin(), list->end());
      list->erase(std::unique(list->begin(), list->end()), list->end());
    };
    each_once(&edges);
    each_once(&vertices);
    std::vector<FloatBox> boxes;
    for (const auto& [a, b] : edges) boxes.push_back(BoxAround(a, b));
    const BoxTree tree(std::move(boxes));
    for (const int vertex : vertices) {
      tree.ForEachOverlap(BoxAround(vertex, vertex), [&](int edge) {
        const auto [a, b] = edges[static_cast<size_t>(edge)];
        if (vertex == a || vertex == b) return;
        const bool is_a = AreOne(vertex, a);
        if (is_a || AreOne(vertex, b)) {
          Join(vertex, is_a ? a : b);
        } else if (LiesOn(vertex, a, b)) {
          on_edge_.emplace(KeyOf(a, b), vertex);
        }
      });
    }
    if (ApplyJoins()) {
      on_edge_.clear();
      return true;
    }
    return CutEdges();
  }

  void Cut(const Corners& c, int depth) {
    constexpr int kDeepest = 40;
    if (cuts_left_ == 0) return;
    --cuts_left_;
    for (size_t k = 0; k < 3 && depth < kDeepest; ++k) {
      const size_t next = (k + 1) % 3, last = (k + 2) % 3;
      const auto found = on_edge_.find(KeyOf(c[k], c[next]));
      if (found == on_edge_.end()) continue;
      const int vertex = found->second;
      if (vertex == c[last]) return;  // nothing of it is left
      Cut({c[k], vertex, c[last]}, depth + 1);
      Cut({vertex, c[next], c[last]}, depth + 1);
      return;
    }
    triangles_.push_back(c);
  }

  const Eigen::Matrix3Xd& vertices_;
  double width_;
  VertexSets sets_;
  bool joins_ = false;
  std::vector<Corners> triangles_;
  size_t cuts_left_ = 0;
  std::vector<uint8_t> near_contact_;  // by vertex, also of thin triangles that were taken out
  std::unordered_map<uint64_t, int> on_edge_;
};

// By vertex, the lowest one of its component.
std::vector<int> ComponentsOf(const TriangleMesh& mesh) {
  VertexSets sets(mesh.vertices.cols());
  for (const auto triangle : mesh.triangles.colwise()) {
    sets.Unite(triangle[0], triangle[1]);
    sets.Unite(triangle[0], triangle[2]);
  }
  std::vector<int> component(static_cast<size_t>(mesh.vertices.cols()));
  for (size_t v = 0; v < component.size(); ++v) component[v] = sets.Find(static_cast<int>(v));
  return component;
}

TriangleMesh Compacted(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& triangles,
                       const std::vector<Eigen::Index>& kept) {
  TriangleMesh mesh{{}, triangles(Eigen::all, kept), {}};
  std::vector<int> number(static_cast<size_t>(vertices.cols()), -1);
  std::vector<Eigen::Index> used;
  for (int& corner : mesh.triangles.reshaped()) {
    int& at = number[static_cast<size_t>(corner)];
    if (at < 0) {
      at = static_cast<int>(used.size());
      used.push_back(corner);
    }
    corner = at;
  }
  mesh.vertices = vertices(Eigen::all, used);
  return mesh;
}

// Without components whose volume is less than `width` times a quarter of their area.
TriangleMesh WithoutFilms(TriangleMesh mesh, double width) {
  const std::vector<int> component = ComponentsOf(mesh);
  std::vector<double> volume(component.size(), 0), area(component.size(), 0);
  for (const auto triangle : mesh.triangles.colwise()) {
    const auto c = static_cast<size_t>(component[static_cast<size_t>(triangle[0])]);
    const Eigen::Vector3d origin = mesh.vertices.col(static_cast<Eigen::Index>(c));
    const Eigen::Vector3d at = mesh.vertices.col(triangle[0]) - origin;
    const Eigen::Vector3d normal = (mesh.vertices.col(triangle[1]) - origin - at)
                                       .cross(mesh.vertices.col(triangle[2]) - origin - at);
    volume[c] += normal.dot(at) / 6;
    area[c] += normal.norm() / 2;
  }
  std::vector<Eigen::Index> kept;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    const auto c = static_cast<size_t>(component[static_cast<size_t>(mesh.triangles(0, t))]);
    if (std::abs(volume[c]) > width * area[c] / 4) kept.push_back(t);
  }
  if (static_cast<Eigen::Index>(kept.size()) == mesh.triangles.cols()) return mesh;
  return Compacted(mesh.vertices, mesh.triangles, kept);
}

}  // namespace

absl::Status TouchesTooFlatly() {
  return absl::FailedPreconditionError(
      "the shapes touch at too flat an angle to decide which parts are joined; move one of them by "
      "a millionth of its size");
}

absl::StatusOr<SeparatedSolids> SeparateContacts(TriangleMesh mesh,
                                                 std::vector<uint8_t> near_contact, double width,
                                                 const RunContext& context) {
  Thinner thinner(mesh.vertices, mesh.triangles, std::move(near_contact), width);
  const Thinner::Outcome outcome = thinner.Run();
  if (outcome == Thinner::Outcome::kGivenUp) return TouchesTooFlatly();
  if (outcome == Thinner::Outcome::kUnchanged) {
    return SeparatedSolids{WithoutFilms(std::move(mesh), width), false};
  }
  PointCloud cloud;
  cloud.points = mesh.vertices;
  cloud.triangles = thinner.triangles();
  absl::StatusOr<TriangleMesh> separated = SolidOfMesh(cloud, context);
  if (absl::IsInvalidArgument(separated.status())) {  // all face each other
    return SeparatedSolids{{}, true};
  }
  RILIEVO_ASSIGN_OR_RETURN(TriangleMesh apart, std::move(separated));
  const auto count = static_cast<int>(apart.vertices.cols());
  const bool sound = BuildMeshTopology(apart.triangles, count).ok() &&
                     SummarizeTopology(apart.triangles, count).closed();
  if (!sound) return TouchesTooFlatly();
  return SeparatedSolids{WithoutFilms(std::move(apart), width), true};
}

}  // namespace rilievo
