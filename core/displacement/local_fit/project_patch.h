// Points around a ray, in its frame.
#pragma once

#include "core/displacement/local_fit/scale_ladder.h"

namespace rilievo {

// Arrays of `count` points that go on, with points of any kind whose normals are zero, to the next
// multiple of kWideLanes.
struct PatchPoints {
  const float *position[3], *normal[3];
  int count;
};

// Where the points are seen from: lengths times `scale` are in spacings.
struct PatchView {
  float origin[3], u[3], v[3], direction[3];  // of the ray
  float height;                               // along it, where heights are measured from
  float foot_normal[3];
  float scale;
  float sheet;  // points farther off than this in height are seen under a slope
};

// Lengths in spacings.
struct SeenPoints {
  float *u, *v, *height, *square, *weight;
  int* window;  // the narrowest that holds each point; kWindowCount where none does
};

// Also counts the points of weight within each window.
void ProjectPatch(const PatchPoints& points, const PatchView& view, const SeenPoints& seen,
                  int* inside);

}  // namespace rilievo
