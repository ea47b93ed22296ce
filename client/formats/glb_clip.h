// A mesh in motion as binary glTF 2.0: morph targets and an animation that goes through them.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "client/formats/glb_contents.h"

namespace rilievo {

// What a later frame adds to the vertices of the mesh, which is the first frame.
struct GlbFrame {
  Eigen::Matrix3Xf moved;   // positions, unit of the scan
  Eigen::Matrix3Xf turned;  // normals; empty where the mesh has none
};

struct GlbClip {
  std::vector<GlbFrame> frames;  // at least one
  double frames_per_second = 24;
};

// The columns of all targets, then the times of the frames, then the weights of the targets at
// each. They refer to the clip.
void AppendClipColumns(const GlbClip& clip, std::vector<GlbColumn>* columns);

// The members "targets" of the primitive and "animations" of the file, each with a comma before it;
// empty where no column is of a clip.
std::string GlbTargets(const std::vector<GlbColumn>& columns);
std::string GlbAnimations(const std::vector<GlbColumn>& columns);

}  // namespace rilievo
