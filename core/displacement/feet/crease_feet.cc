#include "core/displacement/feet/crease_feet.h"

#include <Eigen/Core>

#include "core/base/status_macros.h"
#include "core/loop/split_normals.h"
#include "core/surface/segment_tree.h"

namespace rilievo {

absl::Status AppendCreaseFeet(const OrientedCloud& cloud, const LoopRefinement& refinement,
                              const LevelRings& rings, const LimitSurface& limit,
                              const RunContext& context, std::vector<PointFoot>* feet) {
  if (cloud.sharp_lines.cols() == 0) return absl::OkStatus();
  RILIEVO_ASSIGN_OR_RETURN(const ClosestPointTree tree, TreeOfSegments(cloud.sharp_lines, context));
  RILIEVO_ASSIGN_OR_RETURN(const SharpSectors sectors,
                           SectorsOfLevel(refinement, refinement.max_level()));
  int last = -1;
  for (const int v : sectors.vertices) {  // ascending; a vertex comes once for each side
    if (v == last) continue;
    last = v;
    const Eigen::Vector3d position = limit.positions.col(v);
    const Eigen::Vector3d way =
        NearestOnSegments(tree, cloud.sharp_lines, position).place - position;
    PointFoot foot;
    foot.corner = {v, rings.Of(v)[0], rings.Of(v)[1]};
    foot.weight = {1, 0, 0};
    foot.offset = static_cast<float>(way.dot(limit.normals.col(v)));
    feet->push_back(foot);
  }
  return context.CheckStop();
}

}  // namespace rilievo
