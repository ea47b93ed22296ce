#include "core/surface/segment_tree.h"

namespace rilievo {

absl::StatusOr<ClosestPointTree> TreeOfSegments(const Eigen::Matrix3Xd& ends,
                                                const RunContext& context) {
  Eigen::Matrix3Xi triangles(3, ends.cols() / 2);  // without area
  for (int i = 0; i < triangles.cols(); ++i) triangles.col(i) << 2 * i, 2 * i + 1, 2 * i + 1;
  return ClosestPointTree::Build(ends, triangles, context);
}

}  // namespace rilievo
