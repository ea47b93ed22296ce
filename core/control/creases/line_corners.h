// Where the lines of sharp edges turn.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/loop/crease_topology.h"

namespace rilievo {

// The vertices at which `line` turns by more than `angle` (radians) and more than anywhere nearer
// than `reach` along it; unit frame. Turns are those between the places `reach` before and behind.
// `vertices`: of the mesh. In time proportional to the vertices of the line, but for logarithms.
std::vector<int> CornersOfLine(const Eigen::Matrix3Xd& vertices, const CreaseChain& line,
                               double angle, double reach);

}  // namespace rilievo
