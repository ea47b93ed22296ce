#include "core/loop/patch_lattice.h"

#include <algorithm>
#include <utility>

#include "core/loop/edge_star.h"

namespace rilievo {
namespace {

struct Point {
  int i, j;
};

Point Middle(Point a, Point b) { return {(a.i + b.i) / 2, (a.j + b.j) / 2}; }

using Triangle = std::array<Point, 3>;

std::vector<Triangle> Refined(const std::vector<Triangle>& triangles) {
  std::vector<Triangle> fine;
  for (const auto& [a, b, c] : triangles) {
    const Point ab = Middle(a, b), bc = Middle(b, c), ca = Middle(c, a);
    for (const Triangle& child :
         {Triangle{a, ab, ca}, Triangle{ab, b, bc}, Triangle{ca, bc, c}, Triangle{bc, ca, ab}}) {
      fine.push_back(child);
    }
  }
  return fine;
}

}  // namespace

PatchLattice::PatchLattice(int steps) : steps_(steps), n_(1 << steps) {
  corners_ = {PointAt(0, 0), PointAt(n_, 0), PointAt(0, n_)};
  for (auto& turned : turned_) turned.resize(point_count());
  for (int j = 0; j <= n_; ++j) {
    for (int i = 0; i <= n_ - j; ++i) {
      const int k = n_ - i - j, point = PointAt(i, j);
      if (i > 0 && j > 0 && k > 0) interior_.push_back(point);
      turned_[0][point] = point;
      turned_[1][point] = PointAt(k, i);
      turned_[2][point] = PointAt(j, k);
    }
  }
  for (int k = 1; k < n_; ++k) {
    sides_[0].push_back(PointAt(k, 0));
    sides_[1].push_back(PointAt(n_ - k, k));
    sides_[2].push_back(PointAt(0, n_ - k));
  }
  for (int mask = 0; mask < 8; ++mask) AddPoints(mask);
}

// As LoopRefinement numbers edges: face by face, in each the sides 0, 1, 2, each edge once.
void PatchLattice::AddPoints(int mask) {
  const auto is_foreign = [&](Point p) {
    return (p.j == 0 && (mask & 1) == 0) || (p.i + p.j == n_ && (mask & 2) == 0) ||
           (p.i == 0 && (mask & 4) == 0);
  };
  std::vector<Place> places(point_count(), {-1, -1});
  std::vector<Triangle> triangles = {{Point{0, 0}, Point{n_, 0}, Point{0, n_}}};
  for (int step = 0; step < steps_; ++step) {
    std::vector<int>& added = added_[mask].emplace_back();
    for (const Triangle& triangle : triangles) {
      for (int k = 0; k < 3; ++k) {
        const Point middle = Middle(triangle[k], triangle[(k + 1) % 3]);
        const int point = PointAt(middle.i, middle.j);
        if (is_foreign(middle) || places[point].step >= 0) continue;
        places[point] = {step, static_cast<int>(added.size())};
        added.push_back(point);
      }
    }
    triangles = Refined(triangles);
  }
  for (int side = 0; side < 3; ++side) {
    for (int point : sides_[side]) places_[mask][side].push_back(places[point]);
  }
  if (mask > 0) return;
  triangles_.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (size_t t = 0; t < triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      triangles_(k, static_cast<Eigen::Index>(t)) = PointAt(triangles[t][k].i, triangles[t][k].j);
    }
  }
}

PatchNumbering::PatchNumbering(const MeshTopology& topology, const PatchLattice& lattice)
    : topology_(topology), lattice_(lattice) {
  int64_t edges = topology.edge_count(), faces = topology.face_count();
  first_ = {topology.vertex_count};
  for (int step = 0; step < lattice.steps(); ++step) {
    first_.push_back(static_cast<int>(first_.back() + edges));
    interior_.push_back(3 * ((1 << 2 * step) - (1 << step)) / 2);
    edges = 2 * edges + 3 * faces;
    faces *= 4;
  }
  first_edge_.reserve(topology.face_count());
  masks_.reserve(topology.face_count());
  int met = 0;
  for (int f = 0; f < topology.face_count(); ++f) {
    int mask = 0;
    for (int k = 0; k < 3; ++k) mask |= (topology.face_edges(k, f) >= met) << k;
    first_edge_.push_back(met);
    masks_.push_back(static_cast<uint8_t>(mask));
    met += (mask & 1) + (mask >> 1 & 1) + (mask >> 2);
  }
}

void PatchNumbering::VerticesOf(int face, std::vector<int>& vertices) const {
  vertices.resize(lattice_.point_count());
  const int mask = masks_[face];
  for (int step = 0; step < lattice_.steps(); ++step) {
    int vertex = FirstAdded(face, step);
    for (int point : lattice_.Added(mask, step)) vertices[point] = vertex++;
  }
  for (int k = 0; k < 3; ++k) {
    vertices[lattice_.corners()[k]] = topology_.faces(k, face);
    if ((mask >> k & 1) != 0) continue;
    const int neighbor = topology_.face_neighbors(k, face);
    const int j = CornerOfEdge(topology_, neighbor, topology_.face_edges(k, face));
    const auto& places = lattice_.SidePlaces(masks_[neighbor], j);
    const std::vector<int>& side = lattice_.sides()[k];
    for (size_t i = 0; i < side.size(); ++i) {
      const auto [step, rank] = places[side.size() - 1 - i];
      vertices[side[i]] = FirstAdded(neighbor, step) + rank;
    }
  }
}

}  // namespace rilievo
