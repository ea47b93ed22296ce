#include "core/control/simplify/half_edge_mesh.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"

namespace rilievo {

namespace {

// The first index in [0, count) that `is_fault` holds for, -1 where none is. What else it does must
// concern its index alone.
template <typename IsFault>
absl::StatusOr<int64_t> FirstFault(int64_t count, const RunContext& context,
                                   const IsFault& is_fault) {
  std::vector<int64_t> first(static_cast<size_t>((count + kLightBlock - 1) / kLightBlock), -1);
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(count, kLightBlock, context, [&](int64_t i) {
    int64_t& found = first[i / kLightBlock];
    if (is_fault(static_cast<int>(i)) && found < 0) found = i;
  }));
  const auto found = std::find_if(first.begin(), first.end(), [](int64_t i) { return i >= 0; });
  return found == first.end() ? -1 : *found;
}

}  // namespace

absl::StatusOr<HalfEdgeMesh> HalfEdgeMesh::Build(const Eigen::Matrix3Xi& faces, int vertex_count,
                                                 const RunContext& context) {
  HalfEdgeMesh mesh;
  RILIEVO_RETURN_IF_ERROR(mesh.Link(faces, vertex_count, context));
  RILIEVO_RETURN_IF_ERROR(mesh.CheckFans(context));
  mesh.NumberEdges();
  return mesh;
}

absl::Status HalfEdgeMesh::Link(const Eigen::Matrix3Xi& faces, int vertex_count,
                                const RunContext& context) {
  const int half_count = static_cast<int>(faces.size());
  half_.resize(static_cast<size_t>(half_count));
  // The edges are read, not used, by CheckFans().
  for (int h = 0; h < half_count; ++h) half_[h] = {faces.data()[h], -1, -1};
  std::vector<int> begin(static_cast<size_t>(vertex_count) + 1, 0);
  for (int h = 0; h < half_count; ++h) {
    if (half_[h].from < 0 || half_[h].from >= vertex_count) {
      return absl::InvalidArgumentError(absl::StrCat(
          "face ", h / 3, ": vertex index ", half_[h].from, " is outside [0, ", vertex_count, ")"));
    }
    if (half_[h].from == To(h)) {
      return absl::InvalidArgumentError(
          absl::StrCat("face ", h / 3, " uses vertex ", half_[h].from, " twice"));
    }
    ++begin[half_[h].from + 1];
  }
  for (int v = 0; v < vertex_count; ++v) begin[v + 1] += begin[v];
  std::vector<int> leaving(static_cast<size_t>(half_count));
  std::vector<int> fill(begin.begin(), begin.end() - 1);
  for (int h = 0; h < half_count; ++h) leaving[fill[half_[h].from]++] = h;

  // Finds the other half of each edge.
  const auto is_double = [&](int h) {
    const int from = half_[h].from, to = To(h);
    for (int i = begin[to]; i < begin[to + 1]; ++i) {
      if (To(leaving[i]) == from) half_[h].twin = leaving[i];
    }
    for (int i = begin[from]; i < begin[from + 1]; ++i) {
      if (leaving[i] != h && To(leaving[i]) == to) return true;
    }
    return false;
  };
  RILIEVO_ASSIGN_OR_RETURN(const int64_t fault, FirstFault(half_count, context, is_double));
  if (fault >= 0) {
    const auto h = static_cast<int>(fault);
    return absl::InvalidArgumentError(
        absl::StrCat("edge ", half_[h].from, "-", To(h), " is used twice in the same direction"));
  }

  vertex_.assign(static_cast<size_t>(vertex_count), Vertex());
  for (int h = 0; h < half_count; ++h) {
    int& out = vertex_[half_[h].from].outgoing;
    if (out < 0 || half_[h].twin < 0) out = h;
    ++vertex_[half_[h].from].valence;
    if (half_[h].twin < 0) ++vertex_[To(h)].valence;
  }
  return absl::OkStatus();
}

absl::Status HalfEdgeMesh::CheckFans(const RunContext& context) const {
  const auto joins_fans = [&](int v) {
    if (vertex_[v].outgoing < 0) return false;
    int reached = 0;
    ForEachNeighbor(v, [&](int, int) { ++reached; });
    return reached != vertex_[v].valence;
  };
  RILIEVO_ASSIGN_OR_RETURN(const int64_t fault, FirstFault(vertex_slots(), context, joins_fans));
  if (fault < 0) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("vertex ", fault, " joins more than one fan"));
}

void HalfEdgeMesh::NumberEdges() {
  edge_half_.reserve(half_.size() / 2 + 1);
  for (int h = 0; h < static_cast<int>(half_.size()); ++h) {
    if (half_[h].edge >= 0) continue;
    half_[h].edge = edge_slots();
    if (half_[h].twin >= 0) half_[half_[h].twin].edge = half_[h].edge;
    edge_half_.push_back(h);
  }
}

bool HalfEdgeMesh::CanCollapse(int h, int least_valence) {
  const int a = half_[h].from, b = To(h), twin = half_[h].twin;
  if (twin >= 0 && OnBoundary(a) && OnBoundary(b)) return false;
  const auto apex_can_lose_an_edge = [&](int apex) {
    return vertex_[apex].valence > least_valence - (OnBoundary(apex) ? 1 : 0);
  };
  if (!apex_can_lose_an_edge(half_[Previous(h)].from)) return false;
  if (twin >= 0 && !apex_can_lose_an_edge(half_[Previous(twin)].from)) return false;
  ForEachNeighbor(a, [&](int neighbor, int) { vertex_[neighbor].mark = 1; });
  int common = 0;
  ForEachNeighbor(b, [&](int neighbor, int) { common += vertex_[neighbor].mark; });
  ForEachNeighbor(a, [&](int neighbor, int) { vertex_[neighbor].mark = 0; });
  return common == (twin >= 0 ? 2 : 1);
}

// Takes the face of h away and joins the two edges that meet at its apex.
void HalfEdgeMesh::RemoveFace(int h) {
  const int next = Next(h), previous = Previous(h);
  const int apex = half_[previous].from;
  const int into_end = half_[next].twin, out_of_start = half_[previous].twin;
  const int kept = half_[previous].edge, lost = half_[next].edge;
  if (into_end >= 0) {
    half_[into_end].twin = out_of_start;
    half_[into_end].edge = kept;
  }
  if (out_of_start >= 0) half_[out_of_start].twin = into_end;
  edge_half_[kept] = out_of_start >= 0 ? out_of_start : into_end;
  edge_half_[lost] = -1;
  if (vertex_[apex].outgoing == previous) vertex_[apex].outgoing = into_end;
  --vertex_[apex].valence;
  half_[h].from = half_[next].from = half_[previous].from = -1;
}

void HalfEdgeMesh::Collapse(int h) {
  const int a = half_[h].from, b = To(h), twin = half_[h].twin;
  const bool boundary = OnBoundary(a) || OnBoundary(b);
  const int out = half_[Previous(h)].twin, in = half_[Next(h)].twin;
  int living = out >= 0 ? out : Next(in);
  vertex_[a].valence += vertex_[b].valence - (twin >= 0 ? 4 : 3);

  ForEachOutgoing(b, [&](int leaving) { half_[leaving].from = a; });
  edge_half_[half_[h].edge] = -1;
  RemoveFace(h);
  if (twin >= 0) RemoveFace(twin);
  vertex_[b].outgoing = -1;
  if (boundary) {
    for (int start = living; half_[living].twin >= 0;) {
      living = Next(half_[living].twin);
      if (living == start) break;
    }
  }
  vertex_[a].outgoing = living;
}

}  // namespace rilievo
