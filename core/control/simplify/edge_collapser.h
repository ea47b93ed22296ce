// The edge collapses of a simplification, least error first.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "absl/status/status.h"
#include "core/base/key_heap.h"
#include "core/base/run_context.h"
#include "core/control/simplify/crease_constraints.h"
#include "core/control/simplify/half_edge_mesh.h"
#include "core/control/simplify/quadric.h"
#include "core/control/simplify/simplify_mesh.h"
#include "core/control/simplify/vertex_blocks.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// A mesh under collapses, and what they need to know of it.
class EdgeCollapser {
 public:
  // `planes` of the faces, where not their own, as for SimplifyMesh. A stop request leaves it half
  // done; the caller asks context.CheckStop() after.
  EdgeCollapser(HalfEdgeMesh mesh, ControlMesh input, const SimplifyOptions& options,
                const FacePlanes* planes, const RunContext& context);

  // Collapses on all threads, in every block down to about `share`, (0, 1), of the faces between
  // its inner vertices. The rims stay. The result does not depend on the number of threads.
  // CANCELLED when stopped.
  absl::Status CollapseBlocks(const VertexBlocks& blocks, double share, const RunContext& context);

  // Collapses until `target_faces` are left or no collapse is allowed. Until `coarse` is false the
  // faces made need not be good ones, for they will not last. CANCELLED when stopped.
  absl::Status CollapseTo(int64_t target_faces, bool coarse, const RunContext& context);

  int64_t faces_left() const { return whole_.faces_left; }
  const HalfEdgeMesh& mesh() const { return mesh_; }

  // The mesh without what collapsed, with the creases of the input.
  ControlMesh Compact() const;

 private:
  // What is kept of an edge.
  struct Edge {
    float cost = 0;
    int evaluated = 0;  // the time of the cost
    bool queued = false;
    uint8_t grade = 0;  // index into EdgeCollapserSettings::grades
  };
  struct Vertex {
    Quadric quadric;
    int changed = 0;  // the time of its last collapse
  };
  // Where collapses go on: the whole mesh or the inner vertices of a block.
  struct Front {
    const std::vector<uint8_t>* inner = nullptr;  // null: every vertex
    bool coarse = true;
    int64_t faces_left = 0;
    std::unordered_map<int, int> component_faces;  // of the components that are there
    int time = 0;                                  // collapses so far
    // Each edge at most once, under a cost that may be out of date. Costs grow (see Quadric), but
    // for a few beside creases, so a stale one is a lower bound and is brought up to date when it
    // surfaces.
    KeyHeap queue;

    bool Has(int vertex) const { return inner == nullptr || (*inner)[vertex] != 0; }
  };

  void FindComponents();
  // Returns twice the area, across, of the faces around each vertex.
  std::vector<Eigen::Vector3d> BuildQuadrics(const FacePlanes* planes);
  void FindReferenceNormals(const RunContext& context, std::vector<Eigen::Vector3d> across);
  void AddBoundaryQuadrics(int h, const Eigen::Vector3d& face_normal, double target_edge);
  std::vector<Front> BlockFronts(const VertexBlocks& blocks) const;
  void Seed(int edge, Front* front);
  void Evaluate(int edge, const Front& front);
  absl::Status Run(int64_t target_faces, const RunContext& context, Front* front);
  void Push(int edge, Front* front);
  double CostOf(int edge) const;
  const CollapseGrade& GradeOf(int edge, const Front& front) const;
  // Where the two ends of an edge would meet, by the sum of their quadrics.
  Eigen::Vector3d Meeting(int a, int b, const Quadric& sum) const;
  bool TryCollapse(int edge, Front* front);

  HalfEdgeMesh mesh_;
  const SimplifyOptions& options_;
  double least_turn_cosine_ = 0;
  std::vector<Eigen::Vector3d> positions_;
  std::vector<Vertex> vertices_;
  std::vector<Eigen::Vector3f> reference_normal_;  // per face, of the input
  std::vector<int> component_;                     // per vertex, one of its component
  std::vector<uint8_t> component_open_;            // by that vertex
  CreaseConstraints creases_;
  std::vector<Edge> edges_;
  Front whole_;
};

}  // namespace rilievo
