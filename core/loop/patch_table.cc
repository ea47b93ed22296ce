#include "core/loop/patch_table.h"

#include "core/base/status_macros.h"
#include "core/loop/limit_stencils.h"
#include "core/loop/refinement.h"

namespace rilievo {
namespace {

// Two points side by side; every CPU with vectors of doubles has this much.
typedef double Pair __attribute__((vector_size(16)));

// The faces around a face (0, 1, 2) whose corner 0 has this valence, numbered as PatchRing does.
ControlMesh CollapseGuards(int valence) {
  const std::array<int, 3> valences = {valence, 6, 6};
  const int outer = valence + 3;
  std::vector<Eigen::Vector3i> faces = {{0, 1, 2}};
  int next = 3;  // the outer vertex to come; corner k shares its first with the corner before
  for (int k = 0; k < 3; ++k) {
    int before = next > 3 ? next - 1 : 2 + outer;
    for (int i = 0; i < valences[k] - 3; ++i) {
      faces.emplace_back(k, before, next);
      before = next++;
    }
    faces.emplace_back(k, before, (k + 1) % 3);
  }
  ControlMesh mesh;
  mesh.vertices = Eigen::Matrix3Xd::Zero(3, 3 + outer);
  mesh.faces.resize(3, static_cast<Eigen::Index>(faces.size()));
  for (size_t f = 0; f < faces.size(); ++f) mesh.faces.col(static_cast<Eigen::Index>(f)) = faces[f];
  return mesh;
}

int CornerAt(const MeshTopology& topology, int face, int vertex) {
  return (topology.faces(1, face) == vertex) + 2 * (topology.faces(2, face) == vertex);
}

}  // namespace

absl::StatusOr<PatchTable> PatchTable::Build(int valence, const PatchLattice& lattice) {
  const ControlMesh mesh = CollapseGuards(valence);
  RunContext alone;
  alone.threads = 1;
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement,
                           RefineTopology(mesh, lattice.steps() - 1, alone));
  RILIEVO_ASSIGN_OR_RETURN(const LimitStencils stencils,
                           BuildLimitStencils(refinement, lattice.steps(), alone));
  std::vector<int> vertices;
  PatchNumbering(refinement.levels.front(), lattice).VerticesOf(0, vertices);
  PatchTable table;
  table.ring_size_ = static_cast<int>(mesh.vertices.cols());
  const auto fill = [&](Points& group, std::vector<int> points) {
    if (points.size() % 2 != 0) points.push_back(points.back());
    group.points = std::move(points);
    group.weights.assign(3 * group.points.size() * table.ring_size_, 0.0);
    for (size_t p = 0; p < group.points.size(); ++p) {
      double* const weights = &group.weights[p / 2 * 6 * table.ring_size_ + p % 2];
      const int s = vertices[group.points[p]];
      for (int i = stencils.begin[s]; i < stencils.begin[s + 1]; ++i) {
        double* const entry = weights + 6 * stencils.control_vertices[i];
        entry[0] = stencils.position[i];
        entry[2] = stencils.tangent_u[i];
        entry[4] = stencils.tangent_v[i];
      }
    }
  };
  for (int side = 0; side < 3; ++side) fill(table.groups_[side], lattice.sides()[side]);
  fill(table.groups_[kInterior], lattice.interior());
  return table;
}

void PatchTable::Evaluate(Group group, const std::vector<std::array<double, 3>>& ring,
                          std::vector<PatchSample>& samples) const {
  const Points& points = groups_[group];
  const double* weights = points.weights.data();
  for (size_t p = 0; p < points.points.size(); p += 2) {
    std::array<Pair, 9> sums{};
    for (int j = 0; j < ring_size_; ++j, weights += 6) {
      const Pair x = {ring[j][0], ring[j][0]}, y = {ring[j][1], ring[j][1]},
                 z = {ring[j][2], ring[j][2]};
      for (int kind = 0; kind < 3; ++kind) {
        const Pair weight = {weights[2 * kind], weights[2 * kind + 1]};
        sums[3 * kind] += weight * x;
        sums[3 * kind + 1] += weight * y;
        sums[3 * kind + 2] += weight * z;
      }
    }
    PatchSample& first = samples[points.points[p]];
    PatchSample& second = samples[points.points[p + 1]];
    for (int i = 0; i < 9; ++i) {
      first[i] = sums[i][0];
      second[i] = sums[i][1];
    }
  }
}

void PatchRing(const MeshTopology& topology, int face, int first, std::vector<int>& ring) {
  ring.clear();
  for (int k = 0; k < 3; ++k) ring.push_back(topology.faces((first + k) % 3, face));
  for (int k = 0; k < 3; ++k) {
    const int vertex = ring[k];
    int side = (first + k + 2) % 3, at = face;  // the edge that ends at the vertex
    for (int i = 0; i < topology.valence[vertex] - 2; ++i) {
      at = topology.face_neighbors(side, at);
      const int corner = CornerAt(topology, at, vertex);
      side = (corner + 2) % 3;
      // The first one is the last of the corner before.
      if (i > 0) ring.push_back(topology.faces(side, at));
    }
  }
}

}  // namespace rilievo
