// Targets of samples without a shape behind them.
#pragma once

#include "core/domain/domain_samples.h"
#include "core/domain/sample_targets.h"
#include "tests/scans/random.h"

namespace rilievo {

inline SampleTargets RandomTargets(const DomainSamples& samples) {
  Random random(7);
  SampleTargets targets;
  targets.positions.resize(3, samples.size());
  targets.weighted_directions.resize(9, samples.size());
  for (int i = 0; i < samples.size(); ++i) {
    for (int k = 0; k < 3; ++k) targets.positions(k, i) = random.Uniform(-1, 1);
    for (int k = 0; k < 9; ++k) targets.weighted_directions(k, i) = random.Uniform(-1, 1);
    targets.row_count.push_back(1 + static_cast<int>(random.Below(3)));
  }
  return targets;
}

}  // namespace rilievo
