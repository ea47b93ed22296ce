// Whether a scan fits into memory, or is made by parts.
#pragma once

#include <cstdint>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/reconstruct_options.h"

namespace rilievo {

// How large a scan is, as far as it has to be known.
struct ScanSize {
  int64_t points = 0;  // that are there at least
  int64_t memory = 0;  // that a reconstruction with all of them in memory takes, about
  int64_t limit = 0;   // that there is for it
  bool fits() const { return memory <= limit; }
};

// `memory`: bytes that may be taken; 0: four fifths of the container's or the machine's. The file
// is read for it only where its size leaves it open whether it fits, and then up to the point that
// no longer does. Standard input, which cannot be read twice, counts as no points. The errors of
// LoadScan().
absl::StatusOr<ScanSize> SizeOfScan(const std::string& path, const ScanArguments& arguments,
                                    const ReconstructArguments& options, int64_t memory,
                                    const std::stop_token& stop);

}  // namespace rilievo
