#include "core/meshes/check_mesh.h"

#include <algorithm>
#include <array>
#include <functional>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/parallel_sort.h"
#include "core/base/status_macros.h"
#include "core/meshes/linked_triangles.h"

namespace rilievo {
namespace {

// By point: the first of those at its place that a triangle names, or -1.
absl::StatusOr<std::vector<int>> FirstAtPlace(const PointCloud& mesh, const RunContext& context) {
  std::vector<uint8_t> used(static_cast<size_t>(mesh.points.cols()), 0);
  for (const int corner : mesh.triangles.reshaped()) used[corner] = 1;
  std::vector<int> order;
  for (int i = 0; i < mesh.points.cols(); ++i) {
    if (used[i] != 0 && mesh.points.col(i).allFinite()) order.push_back(i);
  }
  const auto place = [&](int i) {
    return std::tuple(mesh.points(0, i), mesh.points(1, i), mesh.points(2, i));
  };
  const auto before = [&](int a, int b) {
    return std::tuple_cat(place(a), std::tuple(a)) < std::tuple_cat(place(b), std::tuple(b));
  };
  RILIEVO_RETURN_IF_ERROR(ParallelSort(before, context, &order));
  std::vector<int> first(used.size(), -1);
  for (size_t i = 0; i < order.size(); ++i) {
    const bool is_same = i > 0 && place(order[i]) == place(order[i - 1]);
    first[order[i]] = is_same ? first[order[i - 1]] : order[i];
  }
  return first;
}

// The triangles of three different places, each set of three once at most.
absl::StatusOr<Eigen::Matrix3Xi> DistinctTriangles(const Eigen::Matrix3Xi& given,
                                                   const std::vector<int>& first_at_place,
                                                   OppositeTriangles opposite,
                                                   const RunContext& context) {
  struct Entry {
    std::array<int, 3> corners;  // ascending
    int triangle;
    int side;  // that it faces: 1 or -1
    bool operator<(const Entry& other) const {
      return std::tie(corners, triangle) < std::tie(other.corners, other.triangle);
    }
  };
  std::vector<Entry> entries;
  for (int t = 0; t < given.cols(); ++t) {
    Entry entry{{}, t, 0};
    for (int k = 0; k < 3; ++k) entry.corners[k] = first_at_place[given(k, t)];
    const auto& [a, b, c] = entry.corners;
    entry.side = (a < b) + (b < c) + (c < a) == 2 ? 1 : -1;
    std::sort(entry.corners.begin(), entry.corners.end());
    if (a >= 0 && a != b && b != c) entries.push_back(entry);
  }
  RILIEVO_RETURN_IF_ERROR(ParallelSort(std::less<Entry>(), context, &entries));
  std::vector<int> kept;
  for (size_t begin = 0, end; begin < entries.size(); begin = end) {
    int sides = 0;
    for (end = begin; end < entries.size() && entries[end].corners == entries[begin].corners;
         ++end) {
      sides += entries[end].side;
    }
    if (sides == 0 && opposite == OppositeTriangles::kNone) continue;
    while (entries[begin].side * sides < 0) ++begin;
    kept.push_back(entries[begin].triangle);
  }
  std::sort(kept.begin(), kept.end());
  Eigen::Matrix3Xi distinct(3, static_cast<int64_t>(kept.size()));
  for (size_t i = 0; i < kept.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      distinct(k, static_cast<int64_t>(i)) = first_at_place[given(k, kept[i])];
    }
  }
  return distinct;
}

}  // namespace

absl::Status CheckTriangles(const PointCloud& mesh) {
  if (mesh.triangles.cols() == 0) {
    return absl::InvalidArgumentError("triangles: there are none; a mesh needs at least one");
  }
  const auto points = static_cast<int>(mesh.points.cols());
  for (int t = 0; t < mesh.triangles.cols(); ++t) {
    for (const int corner : mesh.triangles.col(t)) {
      if (corner >= 0 && corner < points) continue;
      return absl::InvalidArgumentError(absl::StrCat("triangles: triangle ", t, " names vertex ",
                                                     corner, "; there are the vertices 0 to ",
                                                     points - 1));
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<CheckedMesh> CheckMesh(const PointCloud& mesh, const RunContext& context,
                                      OppositeTriangles opposite) {
  context.Report(Stage::kCheck, 0);
  RILIEVO_RETURN_IF_ERROR(CheckTriangles(mesh));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<int> first, FirstAtPlace(mesh, context));
  CheckedMesh checked;
  checked.figures.triangles = mesh.triangles.cols();
  LinkedTriangles linked;
  RILIEVO_ASSIGN_OR_RETURN(linked.faces,
                           DistinctTriangles(mesh.triangles, first, opposite, context));
  std::vector<int> places;  // the points at them
  for (int i = 0; i < static_cast<int>(first.size()); ++i) {
    checked.figures.welded_vertices += first[i] >= 0 && first[i] != i;
    if (first[i] == i) places.push_back(i);
  }
  if (linked.faces.cols() == 0) {
    return absl::InvalidArgumentError(absl::StrCat(
        "triangles: none of the ", mesh.triangles.cols(),
        " has three finite corners at three different places",
        opposite == OppositeTriangles::kNone ? " and none over it that faces back" : ""));
  }
  RILIEVO_ASSIGN_OR_RETURN(const SpatialFrame frame, BoundingFrame(mesh.points, places));
  checked.frame = Rounded(frame);
  context.Report(Stage::kCheck, 0.3);
  std::vector<int> number(first.size(), -1);
  linked.vertices.resize(3, static_cast<int64_t>(places.size()));
  for (size_t i = 0; i < places.size(); ++i) {
    number[places[i]] = static_cast<int>(i);
    linked.vertices.col(static_cast<int64_t>(i)) =
        checked.frame.UnitFromScan(mesh.points.col(places[i]));
  }
  for (int& corner : linked.faces.reshaped()) corner = number[corner];
  LinkPairs(&linked);
  RILIEVO_RETURN_IF_ERROR(OrientPieces(context, &linked));
  checked.figures.triangles_used = linked.faces.cols();
  checked.figures.dropped = mesh.triangles.cols() - linked.faces.cols();
  if (linked.faces.cols() == 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("triangles: none of the ", mesh.triangles.cols(), " has an area"));
  }
  context.Report(Stage::kCheck, 0.6);
  LinkWedges(&linked);
  checked.source_vertex = SeparateFans(&linked);
  SplitRepeatedEdges(&linked, &checked.source_vertex);
  for (int& place : checked.source_vertex) place = places[place];
  checked.figures.opened_edges = linked.opened;
  checked.figures.flipped = linked.flipped;
  checked.vertices = std::move(linked.vertices);
  checked.triangles = std::move(linked.faces);
  context.Report(Stage::kCheck, 1);
  return checked;
}

}  // namespace rilievo
