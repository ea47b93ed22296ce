#include <string>

#include "client/formats/scan_reader.h"
#include "client/formats/with_input.h"

namespace rilievo {

absl::StatusOr<ScanFile> ReadScan(const std::string& path, const WantedLayers& wanted) {
  return WithInput(path, [&](std::istream& in) { return ReadScanStream(in, path, wanted); });
}

}  // namespace rilievo
