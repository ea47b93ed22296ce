// The limit surface face by face: the fast way to the finest level, without its topology.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/loop/patch_lattice.h"
#include "core/loop/patch_table.h"
#include "core/loop/refinement.h"

namespace rilievo {

struct LimitPoint {
  Eigen::Vector3d position, normal;
};

// Points of vertices first, first + 1, ...
using LimitRun = std::function<void(int first, std::span<const LimitPoint> points)>;

// Limits at one level as EvaluateLimit() gives them, up to rounding, with vertices numbered alike.
// The topology is refined to `level` - steps only, so that each face has at most one irregular
// vertex; below, a face is a table of its vertex' valence times the points around it. The few faces
// at creases, corners, boundaries, and at vertices of more than 32 edges are cut out and go the
// common way.
class LoopPatches {
 public:
  static constexpr int kLeastLevel = 2;

  // level in [2, 8]. Errors as RefineTopology; INVALID_ARGUMENT for a mesh of quads.
  static absl::StatusOr<LoopPatches> Build(const ControlMesh& mesh, int level,
                                           const RunContext& context);

  const MeshTopology& control() const { return refinement_.levels.front(); }
  // The faces that the patches stand over, a level of the refinement.
  const MeshTopology& base() const { return refinement_.levels.back(); }
  const PatchNumbering& numbering() const { return *numbering_; }
  const PatchLattice& lattice() const { return *lattice_; }

  // Each vertex of the level comes in one run. `sink` is called from several threads at once.
  absl::Status Evaluate(const RunContext& context, const LimitRun& sink) const;

 private:
  LoopPatches() = default;
  absl::Status BuildTables();
  void MarkIrregularFaces(const ControlMesh& mesh);
  // False where tangents span no plane.
  bool EvaluateFace(int face, std::vector<int>& ring, std::vector<std::array<double, 3>>& points,
                    std::vector<PatchSample>& samples, std::vector<LimitPoint>& run,
                    const LimitRun& sink) const;
  absl::Status EvaluateCommonWay(const std::vector<uint8_t>& faces, const RunContext& context,
                                 const LimitRun& sink) const;

  LoopRefinement refinement_;
  std::vector<int> corners_;         // of the control mesh
  Eigen::Matrix3Xd control_points_;  // of the control mesh
  Eigen::Matrix3Xd base_points_;     // of base(), subdivided
  double squared_noise_ = 0;
  std::unique_ptr<PatchLattice> lattice_;
  std::unique_ptr<PatchNumbering> numbering_;
  std::vector<std::optional<PatchTable>> tables_;  // by valence
  std::vector<uint8_t> irregular_;                 // per base face: none of the tables serves it
};

}  // namespace rilievo
