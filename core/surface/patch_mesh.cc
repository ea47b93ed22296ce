#include "core/surface/patch_mesh.h"

#include <Eigen/Geometry>
#include <cmath>
#include <utility>
#include <vector>

#include "core/base/large_pages.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/loop/edge_star.h"

namespace rilievo {
namespace {

Eigen::Vector3d Normalized(const Eigen::Vector3d& sum) {
  const double length = sum.norm();
  return length > 0 ? Eigen::Vector3d(sum / length) : Eigen::Vector3d(Eigen::Vector3d::UnitZ());
}

// Puts down the triangles, and sums their normals at the vertices. What a patch knows only a part
// of, corners and sides, is put together afterwards in a fixed order.
class PatchMesher {
 public:
  PatchMesher(const LoopPatches& patches, Eigen::Matrix3Xd vertices, bool with_normals)
      : patches_(patches),
        topology_(patches.base()),
        inside_(patches.lattice().n() - 1),
        with_normals_(with_normals) {
    const Eigen::Index faces = topology_.face_count();
    mesh_.vertices = std::move(vertices);
    mesh_.triangles.resize(3, faces * patches.lattice().triangles().cols());
    HintLargePages(mesh_.triangles.data(), sizeof(int) * mesh_.triangles.size());
    if (!with_normals) return;
    mesh_.normals.resize(3, mesh_.vertices.cols());
    corner_sums_.resize(3, 3 * faces);
    far_sums_.resize(3, Eigen::Index{inside_} * topology_.edge_count());
    HintLargePages(mesh_.normals.data(), sizeof(double) * mesh_.normals.size());
    HintLargePages(far_sums_.data(), sizeof(double) * far_sums_.size());
  }

  absl::StatusOr<TriangleMesh> Run(const RunContext& context) {
    RILIEVO_RETURN_IF_ERROR(
        ParallelFor(topology_.face_count(), kHeavyBlock, context, [&](int64_t begin, int64_t end) {
          Patch patch;
          for (int64_t f = begin; f < end; ++f) {
            patches_.numbering().VerticesOf(static_cast<int>(f), patch.vertices);
            PutTriangles(f, patch);
            if (with_normals_) SumNormals(f, patch);
          }
        }));
    if (!with_normals_) return std::move(mesh_);
    RILIEVO_RETURN_IF_ERROR(
        ParallelFor(topology_.edge_count(), kHeavyBlock, context, [&](int64_t begin, int64_t end) {
          for (int64_t e = begin; e < end; ++e) {
            JoinEdge(static_cast<int>(e));
          }
        }));
    JoinCorners();
    return std::move(mesh_);
  }

 private:
  struct Patch {
    std::vector<int> vertices;
    std::vector<Eigen::Vector3d> points, sums;
  };

  void PutTriangles(Eigen::Index face, const Patch& patch) {
    const Eigen::Matrix3Xi& triangles = patches_.lattice().triangles();
    auto out = mesh_.triangles.middleCols(face * triangles.cols(), triangles.cols()).reshaped();
    const auto in = triangles.reshaped();
    for (Eigen::Index i = 0; i < in.size(); ++i) out[i] = patch.vertices[in[i]];
  }

  void SumNormals(Eigen::Index face, Patch& patch) {
    const PatchLattice& lattice = patches_.lattice();
    patch.points.resize(patch.vertices.size());
    for (size_t p = 0; p < patch.vertices.size(); ++p) {
      patch.points[p] = mesh_.vertices.col(patch.vertices[p]);
    }
    patch.sums.assign(patch.vertices.size(), Eigen::Vector3d::Zero());
    for (const auto triangle : lattice.triangles().colwise()) {
      const int a = triangle[0], b = triangle[1], c = triangle[2];
      const Eigen::Vector3d normal =
          (patch.points[b] - patch.points[a]).cross(patch.points[c] - patch.points[a]);
      patch.sums[a] += normal;
      patch.sums[b] += normal;
      patch.sums[c] += normal;
    }
    for (int point : lattice.interior()) {
      mesh_.normals.col(patch.vertices[point]) = Normalized(patch.sums[point]);
    }
    for (int k = 0; k < 3; ++k) {
      corner_sums_.col(3 * face + k) = patch.sums[lattice.corners()[k]];
      const int edge = topology_.face_edges(k, face);
      const bool near = (patches_.numbering().MaskOf(face) >> k & 1) != 0;
      for (int i = 0; i < inside_; ++i) {
        const int point = lattice.sides()[k][i];
        // The far face runs along the edge backwards.
        if (near) {
          mesh_.normals.col(patch.vertices[point]) = patch.sums[point];
        } else {
          far_sums_.col(Eigen::Index{edge} * inside_ + inside_ - 1 - i) = patch.sums[point];
        }
      }
    }
  }

  void JoinEdge(int edge) {
    const int face = topology_.edge_faces(0, edge);
    const bool boundary = topology_.edge_faces(1, edge) < 0;
    const auto& places = patches_.lattice().SidePlaces(patches_.numbering().MaskOf(face),
                                                       CornerOfEdge(topology_, face, edge));
    for (int i = 0; i < inside_; ++i) {
      const auto [step, rank] = places[i];
      auto normal = mesh_.normals.col(patches_.numbering().FirstAdded(face, step) + rank);
      Eigen::Vector3d sum = normal;
      if (!boundary) sum += far_sums_.col(Eigen::Index{edge} * inside_ + i);
      normal = Normalized(sum);
    }
  }

  void JoinCorners() {
    auto normals = mesh_.normals.leftCols(topology_.vertex_count);
    normals.setZero();
    for (int f = 0; f < topology_.face_count(); ++f) {
      for (int k = 0; k < 3; ++k) {
        normals.col(topology_.faces(k, f)) += corner_sums_.col(3 * Eigen::Index{f} + k);
      }
    }
    for (Eigen::Index v = 0; v < normals.cols(); ++v) normals.col(v) = Normalized(normals.col(v));
  }

  const LoopPatches& patches_;
  const MeshTopology& topology_;
  const int inside_;  // points inside a side
  const bool with_normals_;
  TriangleMesh mesh_;
  Eigen::Matrix3Xd corner_sums_;  // of each base face's corners
  Eigen::Matrix3Xd far_sums_;     // of each base edge's points, on the side of its second face
};

}  // namespace

absl::StatusOr<TriangleMesh> MeshOfPatches(const LoopPatches& patches, Eigen::Matrix3Xd vertices,
                                           bool with_normals, const RunContext& context) {
  return PatchMesher(patches, std::move(vertices), with_normals).Run(context);
}

}  // namespace rilievo
