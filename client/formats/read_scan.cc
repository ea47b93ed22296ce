#include <string>

#include "client/formats/scan_reader.h"
#include "client/formats/trajectory.h"
#include "client/formats/with_input.h"

namespace rilievo {

absl::StatusOr<ScanFile> ReadScan(const std::string& path, const WantedLayers& wanted) {
  return WithInput(path, [&](std::istream& in) { return ReadScanStream(in, path, wanted); });
}

absl::StatusOr<Trajectory> ReadTrajectory(const std::string& path) {
  return WithInput(path, [](std::istream& in) { return Trajectory::Read(in); });
}

}  // namespace rilievo
