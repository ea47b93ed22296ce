// What is wrong with a store, and what can be done about it.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "absl/status/statusor.h"

namespace rilievo {

// Reads everything in `folder`, which no server may use meanwhile: the database, each record of a
// job, each blob against the SHA-256 that names it. Tells `report` of each problem in a line, and
// returns how many are left. With `repair` nothing that is whole is lost: what can be read of a
// damaged database goes into a new one, the old one stays as jobs.db.old; damaged blobs go to the
// folder `damaged`; jobs whose surface is gone say so to their clients.
absl::StatusOr<int64_t> CheckStore(const std::string& folder, bool repair,
                                   const std::function<void(const std::string&)>& report);

}  // namespace rilievo
