// Values at vertices where none were measured.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace rilievo {

// Gives the vertices with known[v] == 0 the values for which each is the mean of its neighbours
// (discrete harmonic), the known ones being the border. A component without any known vertex gets
// the mean of all known values. `values`: one per vertex.
void HarmonicFill(const Eigen::Matrix3Xi& faces, const std::vector<uint8_t>& known,
                  Eigen::VectorXd* values);

}  // namespace rilievo
