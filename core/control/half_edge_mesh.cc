#include "core/control/half_edge_mesh.h"

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace rilievo {

absl::StatusOr<HalfEdgeMesh> HalfEdgeMesh::Build(const Eigen::Matrix3Xi& faces, int vertex_count) {
  HalfEdgeMesh mesh;
  RILIEVO_RETURN_IF_ERROR(mesh.Link(faces, vertex_count));
  RILIEVO_RETURN_IF_ERROR(mesh.CheckFans());
  mesh.NumberEdges();
  mesh.mark_.assign(static_cast<size_t>(vertex_count), 0);
  return mesh;
}

absl::Status HalfEdgeMesh::Link(const Eigen::Matrix3Xi& faces, int vertex_count) {
  const int half_count = static_cast<int>(faces.size());
  from_.assign(faces.data(), faces.data() + half_count);
  std::vector<int> begin(static_cast<size_t>(vertex_count) + 1, 0);
  for (int h = 0; h < half_count; ++h) {
    if (from_[h] < 0 || from_[h] >= vertex_count) {
      return absl::InvalidArgumentError(absl::StrCat("face ", h / 3, ": vertex index ", from_[h],
                                                     " is outside [0, ", vertex_count, ")"));
    }
    if (from_[h] == To(h)) {
      return absl::InvalidArgumentError(
          absl::StrCat("face ", h / 3, " uses vertex ", from_[h], " twice"));
    }
    ++begin[from_[h] + 1];
  }
  for (int v = 0; v < vertex_count; ++v) begin[v + 1] += begin[v];
  std::vector<int> leaving(static_cast<size_t>(half_count));
  std::vector<int> fill(begin.begin(), begin.end() - 1);
  for (int h = 0; h < half_count; ++h) leaving[fill[from_[h]]++] = h;

  twin_.assign(static_cast<size_t>(half_count), -1);
  edge_.assign(static_cast<size_t>(half_count), -1);  // read, not used, by CheckFans()
  for (int h = 0; h < half_count; ++h) {
    const int from = from_[h], to = To(h);
    for (int i = begin[from]; i < begin[from + 1]; ++i) {
      if (leaving[i] != h && To(leaving[i]) == to) {
        return absl::InvalidArgumentError(
            absl::StrCat("edge ", from, "-", to, " is used twice in the same direction"));
      }
    }
    for (int i = begin[to]; i < begin[to + 1]; ++i) {
      if (To(leaving[i]) == from) twin_[h] = leaving[i];
    }
  }

  outgoing_.assign(static_cast<size_t>(vertex_count), -1);
  valence_.assign(static_cast<size_t>(vertex_count), 0);
  for (int h = 0; h < half_count; ++h) {
    int& out = outgoing_[from_[h]];
    if (out < 0 || twin_[h] < 0) out = h;
    ++valence_[from_[h]];
    if (twin_[h] < 0) ++valence_[To(h)];
  }
  return absl::OkStatus();
}

absl::Status HalfEdgeMesh::CheckFans() const {
  for (int v = 0; v < vertex_slots(); ++v) {
    if (outgoing_[v] < 0) continue;
    int reached = 0;
    ForEachNeighbor(v, [&](int, int) { ++reached; });
    if (reached != valence_[v]) {
      return absl::InvalidArgumentError(absl::StrCat("vertex ", v, " joins more than one fan"));
    }
  }
  return absl::OkStatus();
}

void HalfEdgeMesh::NumberEdges() {
  edge_half_.reserve(from_.size() / 2 + 1);
  for (int h = 0; h < static_cast<int>(from_.size()); ++h) {
    if (edge_[h] >= 0) continue;
    edge_[h] = edge_slots();
    if (twin_[h] >= 0) edge_[twin_[h]] = edge_[h];
    edge_half_.push_back(h);
  }
}

bool HalfEdgeMesh::CanCollapse(int h, int least_valence) {
  const int a = from_[h], b = To(h), twin = twin_[h];
  if (twin >= 0 && OnBoundary(a) && OnBoundary(b)) return false;
  const auto apex_can_lose_an_edge = [&](int apex) {
    return valence_[apex] > least_valence - (OnBoundary(apex) ? 1 : 0);
  };
  if (!apex_can_lose_an_edge(from_[Previous(h)])) return false;
  if (twin >= 0 && !apex_can_lose_an_edge(from_[Previous(twin)])) return false;
  ForEachNeighbor(a, [&](int neighbor, int) { mark_[neighbor] = 1; });
  int common = 0;
  ForEachNeighbor(b, [&](int neighbor, int) { common += mark_[neighbor]; });
  ForEachNeighbor(a, [&](int neighbor, int) { mark_[neighbor] = 0; });
  return common == (twin >= 0 ? 2 : 1);
}

// Takes the face of h away and joins the two edges that meet at its apex.
void HalfEdgeMesh::RemoveFace(int h) {
  const int next = Next(h), previous = Previous(h);
  const int apex = from_[previous];
  const int into_end = twin_[next], out_of_start = twin_[previous];
  const int kept = edge_[previous], lost = edge_[next];
  if (into_end >= 0) {
    twin_[into_end] = out_of_start;
    edge_[into_end] = kept;
  }
  if (out_of_start >= 0) twin_[out_of_start] = into_end;
  edge_half_[kept] = out_of_start >= 0 ? out_of_start : into_end;
  edge_half_[lost] = -1;
  if (outgoing_[apex] == previous) outgoing_[apex] = into_end;
  --valence_[apex];
  from_[h] = from_[next] = from_[previous] = -1;
}

void HalfEdgeMesh::Collapse(int h) {
  const int a = from_[h], b = To(h), twin = twin_[h];
  const bool boundary = OnBoundary(a) || OnBoundary(b);
  const int out = twin_[Previous(h)], in = twin_[Next(h)];
  int living = out >= 0 ? out : Next(in);
  valence_[a] += valence_[b] - (twin >= 0 ? 4 : 3);

  ForEachOutgoing(b, [&](int leaving) { from_[leaving] = a; });
  edge_half_[edge_[h]] = -1;
  RemoveFace(h);
  if (twin >= 0) RemoveFace(twin);
  outgoing_[b] = -1;
  if (boundary) {
    for (int start = living; twin_[living] >= 0;) {
      living = Next(twin_[living]);
      if (living == start) break;
    }
  }
  outgoing_[a] = living;
}

}  // namespace rilievo
