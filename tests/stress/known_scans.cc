#include "tests/stress/known_scans.h"

#include <utility>

#include "core/pipeline/reconstruct.h"
#include "tests/scans/scanner.h"

namespace rilievo::stress {

PointCloud Simulated(const char* shape, int64_t points, double noise, uint64_t seed) {
  ScannerOptions options;
  options.points = points;
  options.noise = noise;
  options.seed = seed;
  return SimulateScan(**MakeShape(shape), options)->cloud;
}

const std::vector<KnownScan>& KnownScans() {
  static const std::vector<KnownScan> scans = [] {
    std::vector<KnownScan> result;
    for (const auto& [shape, points] : {std::pair("sphere", 2'000), std::pair("torus", 3'000),
                                        std::pair("genus2", 4'000), std::pair("sphere", 5'000)}) {
      KnownScan known;
      known.cloud = Simulated(shape, points);
      known.packed = PackScan(known.cloud);
      known.surface = Reconstruct(known.cloud, {}, {})->encoded.Concatenate();
      result.push_back(std::move(known));
    }
    return result;
  }();
  return scans;
}

}  // namespace rilievo::stress
