#include "core/control/simplify/edge_collapser.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/base/parallel_for.h"
#include "core/base/parallel_for_each.h"
#include "core/base/run_concurrently.h"
#include "core/base/status_macros.h"
#include "core/control/simplify/collapse_guards.h"
#include "core/control/simplify/settings.h"
#include "core/geometry/disjoint_sets.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kCollapsesAtOnce = 4096;

double Jitter(int edge) {
  const uint32_t mixed = static_cast<uint32_t>(edge) * 2654435769U;  // Fibonacci hashing
  return 1 + kEdgeCollapser.jitter * static_cast<double>(mixed >> 8) / (1 << 24);
}

}  // namespace

EdgeCollapser::EdgeCollapser(HalfEdgeMesh mesh, ControlMesh input, const SimplifyOptions& options,
                             const FacePlanes* planes, const RunContext& context)
    : mesh_(std::move(mesh)), options_(options), creases_(mesh_, input) {
  whole_.faces_left = mesh_.face_slots();
  positions_.resize(static_cast<size_t>(mesh_.vertex_slots()));
  for (int v = 0; v < mesh_.vertex_slots(); ++v) positions_[v] = input.vertices.col(v);
  input = ControlMesh();
  vertices_.resize(positions_.size());
  edges_.resize(static_cast<size_t>(mesh_.edge_slots()));
  least_turn_cosine_ = std::cos(options_.max_normal_turn_degrees * std::numbers::pi / 180);
  std::vector<Vector3d> across;
  const auto find_components = [&] {
    FindComponents();
    return absl::OkStatus();
  };
  const auto build_quadrics = [&] {
    across = BuildQuadrics(planes);
    return absl::OkStatus();
  };
  RunConcurrently(context, build_quadrics, find_components).IgnoreError();
  FindReferenceNormals(context, std::move(across));
}

void EdgeCollapser::FindComponents() {
  DisjointSets components(static_cast<size_t>(mesh_.vertex_slots()));
  for (int h = 0; h < 3 * mesh_.face_slots(); ++h) components.Unite(mesh_.From(h), mesh_.To(h));
  component_.resize(static_cast<size_t>(mesh_.vertex_slots()));
  component_open_.assign(component_.size(), 0);
  for (int v = 0; v < mesh_.vertex_slots(); ++v) {
    component_[v] = static_cast<int>(components.Find(v));
    if (mesh_.OnBoundary(v)) component_open_[component_[v]] = 1;
  }
  for (int f = 0; f < mesh_.face_slots(); ++f) {
    ++whole_.component_faces[component_[mesh_.From(3 * f)]];
  }
}

std::vector<Vector3d> EdgeCollapser::BuildQuadrics(const FacePlanes* planes) {
  std::vector<Vector3d> across(positions_.size(), Vector3d::Zero());
  const auto corners_of = [&](int f) -> Eigen::Vector3i {
    return {mesh_.From(3 * f), mesh_.From(3 * f + 1), mesh_.From(3 * f + 2)};
  };
  const auto cross_of = [&](int f) -> Vector3d {
    const Eigen::Vector3i corner = corners_of(f);
    const Vector3d& a = positions_[corner[0]];
    return (positions_[corner[1]] - a).cross(positions_[corner[2]] - a);
  };
  const auto normal_of = [](const Vector3d& cross) {
    const double length = cross.norm();
    return length > 0 ? Vector3d(cross / length) : Vector3d(Vector3d::Zero());
  };
  double area_sum = 0;
  for (int f = 0; f < mesh_.face_slots(); ++f) {
    const Eigen::Vector3i corner = corners_of(f);
    const Vector3d &a = positions_[corner[0]], &b = positions_[corner[1]],
                   &c = positions_[corner[2]];
    const Vector3d cross = cross_of(f);
    double area = cross.norm() / 2;
    area_sum += area;
    if (planes != nullptr && !planes->weights.empty()) area *= double{planes->weights[f]};
    Quadric plane;
    if (planes != nullptr && planes->normals.cols() > 0) {
      plane.AddPlane(planes->normals.col(f), planes->points.col(f), area / 3);
    } else {
      plane.AddPlane(normal_of(cross), (a + b + c) / 3, area / 3);
    }
    for (int k = 0; k < 3; ++k) {
      vertices_[corner[k]].quadric += plane;
      vertices_[corner[k]].quadric.AddPoint(positions_[corner[k]], options_.evenness * area / 3);
      across[corner[k]] += cross;
    }
  }
  const double target_edge =
      std::sqrt(area_sum / std::max(1, options_.target_faces) * 4 / std::numbers::sqrt3);
  for (int h = 0; h < 3 * mesh_.face_slots(); ++h) {
    if (mesh_.Twin(h) < 0) AddBoundaryQuadrics(h, normal_of(cross_of(h / 3)), target_edge);
  }
  return across;
}

// A marching-cubes sliver points anywhere; its corners' mean normal does not.
void EdgeCollapser::FindReferenceNormals(const RunContext& context, std::vector<Vector3d> across) {
  for (Vector3d& normal : across) normal.normalize();
  reference_normal_.resize(static_cast<size_t>(mesh_.face_slots()));
  const auto find = [&](int64_t begin, int64_t end) {
    for (int f = static_cast<int>(begin); f < end; ++f) {
      Vector3d mean = Vector3d::Zero();
      for (int k = 0; k < 3; ++k) mean += across[mesh_.From(3 * f + k)];
      reference_normal_[f] = mean.normalized().cast<float>();
    }
  };
  ParallelFor(mesh_.face_slots(), kLightBlock, context, find).IgnoreError();
}

// A boundary edge counts as a wall of the height of a final edge, upright on its face: then the
// boundary's weight against the surface's does not hang on how fine the input is.
void EdgeCollapser::AddBoundaryQuadrics(int h, const Vector3d& face_normal, double target_edge) {
  const int from = mesh_.From(h), to = mesh_.To(h);
  const Vector3d along = positions_[to] - positions_[from];
  const double length = along.norm();
  if (!(length > 0)) return;
  const double weight = options_.boundary_weight * length * target_edge / 2;
  const Vector3d side = along.cross(face_normal) / length;
  for (const int v : {from, to}) {
    vertices_[v].quadric.AddPlane(side, positions_[from], weight);
    vertices_[v].quadric.AddPoint(positions_[v], options_.evenness * weight);
  }
}

double EdgeCollapser::CostOf(int edge) const {
  const int h = mesh_.HalfOfEdge(edge);
  const int a = mesh_.From(h), b = mesh_.To(h);
  Quadric sum = vertices_[a].quadric;
  sum += vertices_[b].quadric;
  return Jitter(edge) * std::max(0.0, sum(Meeting(a, b, sum)));
}

Vector3d EdgeCollapser::Meeting(int a, int b, const Quadric& sum) const {
  const VertexConstraint of_a = creases_.ConstraintOf(a), of_b = creases_.ConstraintOf(b);
  if (of_a != of_b) return positions_[of_a > of_b ? a : b];
  return sum.Minimum((positions_[a] + positions_[b]) / 2);
}

const CollapseGrade& EdgeCollapser::GradeOf(int edge, const Front& front) const {
  return front.coarse ? kEdgeCollapser.coarse : kEdgeCollapser.grades[edges_[edge].grade];
}

void EdgeCollapser::Push(int edge, Front* front) {
  edges_[edge].queued = true;
  front->queue.Push(KeyHeap::KeyOf(edges_[edge].cost, edge));
}

void EdgeCollapser::Evaluate(int edge, const Front& front) {
  edges_[edge].cost = static_cast<float>(CostOf(edge));
  edges_[edge].evaluated = front.time;
  edges_[edge].grade = 0;
}

// Into the queue of a front that is not run yet.
void EdgeCollapser::Seed(int edge, Front* front) {
  Evaluate(edge, *front);
  edges_[edge].queued = true;
  front->queue.Append(KeyHeap::KeyOf(edges_[edge].cost, edge));
}

absl::Status EdgeCollapser::CollapseTo(int64_t target_faces, bool coarse,
                                       const RunContext& context) {
  whole_.coarse = coarse;
  whole_.queue.Clear();
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(mesh_.edge_slots(), kLightBlock, context, [&](int64_t begin, int64_t end) {
        for (int edge = static_cast<int>(begin); edge < end; ++edge) {
          edges_[edge].queued = mesh_.HalfOfEdge(edge) >= 0;
          if (edges_[edge].queued) Evaluate(edge, whole_);
        }
      }));
  for (int edge = 0; edge < mesh_.edge_slots(); ++edge) {
    if (edges_[edge].queued) whole_.queue.Append(KeyHeap::KeyOf(edges_[edge].cost, edge));
  }
  return Run(target_faces, context, &whole_);
}

// A block's front counts the faces between inner vertices, for the rim stays as it is, and so those
// of each component: where it has no more than its floor of them, the component is left alone.
std::vector<EdgeCollapser::Front> EdgeCollapser::BlockFronts(const VertexBlocks& blocks) const {
  std::vector<Front> fronts(blocks.count());
  for (Front& front : fronts) {
    front.inner = &blocks.inner;
  }
  for (int f = 0; f < mesh_.face_slots(); ++f) {
    bool inner = true;
    for (int k = 0; k < 3; ++k) inner = inner && blocks.inner[mesh_.From(3 * f + k)] != 0;
    if (!inner) continue;
    const int a = mesh_.From(3 * f);
    ++fronts[blocks.block_of[a]].faces_left;
    ++fronts[blocks.block_of[a]].component_faces[component_[a]];
  }
  return fronts;
}

absl::Status EdgeCollapser::CollapseBlocks(const VertexBlocks& blocks, double share,
                                           const RunContext& context) {
  std::vector<Front> fronts = BlockFronts(blocks);
  for (const Front& front : fronts) whole_.faces_left -= front.faces_left;
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(blocks.count(), 1, context, [&](int64_t k) {
    Front& front = fronts[k];
    for (int place = blocks.begin[k]; place < blocks.begin[k + 1]; ++place) {
      const int v = blocks.order[place];
      if (!front.Has(v)) continue;
      mesh_.ForEachNeighbor(v, [&](int w, int edge) {
        if (v < w && front.Has(w)) Seed(edge, &front);
      });
    }
    const double target = share * static_cast<double>(front.faces_left);
    // Stopped or not is asked once more by ParallelFor.
    Run(static_cast<int64_t>(target), context, &front).IgnoreError();
  }));
  for (const Front& front : fronts) {
    whole_.faces_left += front.faces_left;
    whole_.time = std::max(whole_.time, front.time);
  }
  whole_.component_faces.clear();
  for (int f = 0; f < mesh_.face_slots(); ++f) {
    if (mesh_.FaceAlive(f)) ++whole_.component_faces[component_[mesh_.From(3 * f)]];
  }
  return context.CheckStop();
}

absl::Status EdgeCollapser::Run(int64_t target_faces, const RunContext& context, Front* front) {
  front->queue.Order();
  for (int64_t step = 0; !front->queue.empty() && front->faces_left > target_faces; ++step) {
    if (step % kCollapsesAtOnce == 0) RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    const int edge = KeyHeap::IndexOf(front->queue.Pop());
    Edge& first = edges_[edge];
    first.queued = false;
    const int h = mesh_.HalfOfEdge(edge);
    if (h < 0) continue;
    if (first.evaluated <
        std::max(vertices_[mesh_.From(h)].changed, vertices_[mesh_.To(h)].changed)) {
      Evaluate(edge, *front);
      Push(edge, front);
      continue;
    }
    if (TryCollapse(edge, front) || front->coarse || first.grade == kEdgeCollapser.last_grade)
      continue;
    ++first.grade;
    first.cost *= kEdgeCollapser.grade_cost;
    Push(edge, front);
  }
  return absl::OkStatus();
}

bool EdgeCollapser::TryCollapse(int edge, Front* front) {
  const int h = mesh_.HalfOfEdge(edge);
  const int a = mesh_.From(h), b = mesh_.To(h);
  const int lost = mesh_.Twin(h) >= 0 ? 2 : 1;
  const CollapseGrade& guards = GradeOf(edge, *front);
  const int component = component_[a];
  const int floor =
      component_open_[component] != 0 ? kEdgeCollapser.open_floor : kEdgeCollapser.closed_floor;
  if (front->component_faces[component] - lost < floor) return false;
  if (mesh_.Valence(a) + mesh_.Valence(b) - 2 - lost >
      options_.max_valence + guards.valence_slack) {
    return false;
  }
  if (!creases_.Allow(mesh_, h) || !mesh_.CanCollapse(h, guards.least_valence)) return false;
  Quadric sum = vertices_[a].quadric;
  sum += vertices_[b].quadric;
  const CollapseGuards faces{mesh_, positions_, reference_normal_, least_turn_cosine_};
  const auto fits = [&](const Vector3d& place) {
    return creases_.KeepTurns(mesh_, positions_, h, place) &&
           faces.KeepShape(a, b, place, guards.roundness);
  };
  Vector3d position = Meeting(a, b, sum);
  if (!fits(position)) {
    if (creases_.ConstraintOf(a) != creases_.ConstraintOf(b)) return false;
    // A knot of slivers has no good place for a vertex, but staying at one end harms nobody.
    if (!front->coarse && edges_[edge].grade < kEdgeCollapser.last_grade) return false;
    position = positions_[a];
    if (!fits(position)) position = positions_[b];
    if (!fits(position)) return false;
  }

  creases_.Merge(mesh_, h);
  mesh_.Collapse(h);
  positions_[a] = position;
  vertices_[a].quadric = sum;
  vertices_[a].changed = ++front->time;
  front->faces_left -= lost;
  front->component_faces[component] -= lost;
  // What was refused around here may do now.
  mesh_.ForEachNeighbor(a, [&](int neighbor, int around) {
    if (edges_[around].queued || !front->Has(neighbor)) return;
    edges_[around].grade = 0;
    Push(around, front);
  });
  return true;
}

ControlMesh EdgeCollapser::Compact() const {
  std::vector<int> renumbered(positions_.size(), -1);
  ControlMesh result;
  int vertices = 0;
  for (int v = 0; v < mesh_.vertex_slots(); ++v) {
    if (mesh_.Outgoing(v) >= 0) renumbered[v] = vertices++;
  }
  result.vertices.resize(3, vertices);
  for (int v = 0; v < mesh_.vertex_slots(); ++v) {
    if (renumbered[v] >= 0) result.vertices.col(renumbered[v]) = positions_[v];
  }
  result.faces.resize(3, whole_.faces_left);
  int face = 0;
  for (int f = 0; f < mesh_.face_slots(); ++f) {
    if (!mesh_.FaceAlive(f)) continue;
    for (int k = 0; k < 3; ++k) result.faces(k, face) = renumbered[mesh_.From(3 * f + k)];
    ++face;
  }
  creases_.Tag(mesh_, renumbered, &result);
  return result;
}

}  // namespace rilievo
