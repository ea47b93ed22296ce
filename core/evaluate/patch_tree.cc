// The table of a LimitEvaluator: faces are cut until each part is regular or beside one irregular
// vertex.
#include <Eigen/Core>
#include <algorithm>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/large_pages.h"
#include "core/base/status_macros.h"
#include "core/evaluate/face_surroundings.h"
#include "core/evaluate/limit_evaluator.h"
#include "core/loop/limit_stencils.h"
#include "core/loop/refinement.h"
#include "core/loop/split_normals.h"
#include "core/loop/sub_mesh.h"

namespace rilievo {
namespace {

// From this level on a part beside one irregular vertex is a fan, before it is cut. A fan takes
// some five times as long as a patch; each level more leaves a quarter of its area to fans and
// doubles the patches, which soon fill the caches: 1, 2 and 3 are as fast as each other on 4 800
// faces.
constexpr int kFanLevel = 2;
constexpr int64_t kPatchesPerFace = 64;

}  // namespace

class PatchTreeBuilder {
 public:
  PatchTreeBuilder(const ControlMesh& mesh, const RunContext& context)
      : mesh_(mesh), context_(context) {}

  absl::StatusOr<LimitEvaluator> Run() {
    RILIEVO_RETURN_IF_ERROR(StartWithControlFaces());
    for (int depth = 0; !parts_.empty(); ++depth) {
      RILIEVO_RETURN_IF_ERROR(context_.CheckStop());
      cut_.assign(level_.topology.face_count(), 0);
      node_of_.assign(level_.topology.face_count(), -1);
      control_face_of_.assign(level_.topology.face_count(), -1);
      for (const Part& part : parts_) Take(part, depth);
      parts_.clear();
      const int64_t most = LimitEvaluator::kMostPatches + kPatchesPerFace * mesh_.faces.cols();
      if (static_cast<int64_t>(made_.patches_.size() + 4 * made_.nodes_.size()) > most) {
        return absl::ResourceExhaustedError(
            absl::StrCat("the semi-sharp edges of this surface need more than ", most,
                         " patches; give fewer edges a sharpness between 0 and 10"));
      }
      RILIEVO_RETURN_IF_ERROR(CutOn());
    }
    // In one piece of memory that is known to be large: its pages are asked for at random.
    std::vector<QuarticPatch> patches;
    patches.reserve(made_.patches_.size());
    HintLargePages(patches.data(), sizeof(QuarticPatch) * made_.patches_.size());
    patches.assign(made_.patches_.begin(), made_.patches_.end());
    made_.patches_ = std::move(patches);
    return std::move(made_);
  }

 private:
  using Node = LimitEvaluator::Node;

  // A face of the level, its control face, and where its code goes: ~f for the root of control face
  // f, else 4 n + c for child c of node n.
  struct Part {
    int face, control_face;
    int64_t place;
  };

  absl::Status StartWithControlFaces() {
    RILIEVO_ASSIGN_OR_RETURN(LoopRefinement control, RefineTopology(mesh_, 0, context_));
    RILIEVO_RETURN_IF_ERROR(TakeLimits(control));
    std::vector<SharpEdge> tagged;
    if (!control.sharp.empty()) tagged = std::move(control.sharp.levels.front().edges);
    level_ = TaggedLevel::Of(std::move(control.levels.front()), mesh_.vertices, std::move(tagged),
                             mesh_.corners);
    made_.roots_.resize(level_.topology.face_count());
    for (int f = 0; f < level_.topology.face_count(); ++f) parts_.push_back({f, f, ~int64_t{f}});
    return absl::OkStatus();
  }

  // Limits and tangents of the control vertices, by face corner (half_edges.h).
  absl::Status TakeLimits(const LoopRefinement& control) {
    RILIEVO_ASSIGN_OR_RETURN(const LimitStencils stencils,
                             BuildLimitStencils(control, 0, context_));
    RILIEVO_ASSIGN_OR_RETURN(const SharpSectors sectors, SectorsOfLevel(control, 0));
    const auto sum = [&](int begin, int end, const std::vector<int>& of,
                         const std::vector<double>& weights) {
      Eigen::Vector3d point = Eigen::Vector3d::Zero();
      for (int i = begin; i < end; ++i) point += weights[i] * mesh_.vertices.col(of[i]);
      return point;
    };
    limits_.resize(3, 3 * mesh_.faces.cols());
    tangents_u_.resize(3, limits_.cols());
    tangents_v_.resize(3, limits_.cols());
    for (Eigen::Index h = 0; h < limits_.cols(); ++h) {
      const int v = mesh_.faces.data()[h];
      const auto of_vertex = [&](const std::vector<double>& weights) {
        return sum(stencils.begin[v], stencils.begin[v + 1], stencils.control_vertices, weights);
      };
      limits_.col(h) = of_vertex(stencils.position);
      tangents_u_.col(h) = of_vertex(stencils.tangent_u);
      tangents_v_.col(h) = of_vertex(stencils.tangent_v);
    }
    const SectorStencils& sides = stencils.sectors;
    for (int s = 0; s < sectors.size(); ++s) {
      const auto of_side = [&](const std::vector<double>& weights) {
        return sum(sides.begin[s], sides.begin[s + 1], sides.control_vertices, weights);
      };
      const Eigen::Vector3d u = of_side(sides.tangent_u), v = of_side(sides.tangent_v);
      for (int i = sectors.begin[s]; i < sectors.begin[s + 1]; ++i) {
        tangents_u_.col(sectors.half_edges[i]) = u;
        tangents_v_.col(sectors.half_edges[i]) = v;
      }
    }
    return absl::OkStatus();
  }

  // Makes a patch or a fan of the part, or a node whose children are parts of the next level.
  void Take(const Part& part, int depth) {
    int irregular = 0, corner = 0;
    for (int k = 0; k < 3; ++k) {
      if (IsRegularCorner(level_, part.face, k)) continue;
      ++irregular;
      corner = k;
    }
    const int vertex = level_.topology.faces(corner, part.face);
    if (irregular == 0) {
      Put(part.place, ~static_cast<int32_t>(2 * made_.patches_.size()));
      made_.patches_.push_back(QuarticPatch::Over(RingOf(level_, part.face)));
    } else if (depth >= kFanLevel && irregular == 1 && level_.settled[vertex] != 0) {
      Put(part.place, ~static_cast<int32_t>(2 * made_.fans_.size() + 1));
      const int half_edge = 3 * part.control_face + corner;
      made_.fans_.push_back({IrregularFan::At(level_, part.face, corner), corner,
                             limits_.col(half_edge), tangents_u_.col(half_edge),
                             tangents_v_.col(half_edge)});
    } else {
      Put(part.place, static_cast<int32_t>(made_.nodes_.size()));
      cut_[part.face] = 1;
      node_of_[part.face] = static_cast<int>(made_.nodes_.size());
      control_face_of_[part.face] = part.control_face;
      made_.nodes_.push_back(Node{});
    }
  }

  void Put(int64_t place, int32_t code) {
    if (place < 0) {
      made_.roots_[~place] = code;
    } else {
      made_.nodes_[place / 4][place % 4] = code;
    }
  }

  // The next level of the faces to be cut, and their children as parts.
  absl::Status CutOn() {
    if (std::find(cut_.begin(), cut_.end(), 1) == cut_.end()) return absl::OkStatus();
    const SubMesh sub =
        CutFacesOut(level_.topology, level_.points, cut_, level_.tagged, level_.corners);
    RILIEVO_ASSIGN_OR_RETURN(LoopRefinement finer, RefineTopology(sub.mesh, 1, context_));
    std::vector<SharpEdge> tagged;
    if (!finer.sharp.empty()) tagged = std::move(finer.sharp.levels[1].edges);
    for (size_t i = 0; i < sub.faces.size(); ++i) {
      const int node = node_of_[sub.faces[i]];
      if (node < 0) continue;
      for (int child = 0; child < 4; ++child) {
        parts_.push_back({static_cast<int>(4 * i) + child, control_face_of_[sub.faces[i]],
                          4 * int64_t{node} + child});
      }
    }
    Eigen::Matrix3Xd points = SubdivideOnce(finer, 0, sub.mesh.vertices);
    level_ = TaggedLevel::Of(std::move(finer.levels[1]), std::move(points), std::move(tagged),
                             sub.mesh.corners);
    return absl::OkStatus();
  }

  const ControlMesh& mesh_;
  const RunContext& context_;
  LimitEvaluator made_;
  Eigen::Matrix3Xd limits_, tangents_u_, tangents_v_;  // column = corner of a control face
  TaggedLevel level_;
  std::vector<Part> parts_;
  std::vector<uint8_t> cut_;                    // of each face of the level
  std::vector<int> node_of_, control_face_of_;  // of each face that is cut
};

absl::StatusOr<LimitEvaluator> LimitEvaluator::Build(const ControlMesh& mesh,
                                                     const RunContext& context) {
  if (mesh.quads()) {
    LimitEvaluator made;
    RILIEVO_ASSIGN_OR_RETURN(made.quads_, QuadEvaluator::Build(mesh, context));
    return made;
  }
  return PatchTreeBuilder(mesh, context).Run();
}

}  // namespace rilievo
