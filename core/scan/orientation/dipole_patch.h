// Parts of a scan that are turned as one, and by how much they agree.
#pragma once

#include <span>
#include <vector>

#include "core/points/oriented_cloud.h"
#include "core/scan/orientation/dipole.h"

namespace rilievo {

// Points that are turned together. Lengths in the unit frame.
struct DipolePatch : DipoleSum {
  std::vector<int> patches;
  std::vector<Dipole> points;
};

// Of those `points` of the cloud, which make up `patches`.
DipolePatch MakeDipolePatch(const OrientedCloud& cloud, std::span<const int> points,
                            std::vector<int> patches);

// By how much the winding numbers of one fall along the other: the sum over all pairs of their
// points, or of the sums alone where they lie farther apart than twice their radii together.
// Symmetric.
double Agreement(const DipolePatch& a, const DipolePatch& b);

// Whether the balls around them meet.
bool Touch(const DipolePatch& a, const DipolePatch& b);

}  // namespace rilievo
