// Jobs that do not fit into memory, and are made by parts.
#pragma once

#include <string>

#include "core/pipeline/reconstruct.h"
#include "server/conversion/job_request.h"

namespace rilievo {

// Why it cannot: parts are made of scans, and of the places of their points alone. Empty: it can.
std::string ReasonAgainstParts(const JobRequest& job);

// For the report of a scan that is made by parts without having been asked to be. Empty where
// nothing but the places of its points was wanted.
std::string PlacesAloneWarning(bool colors, bool stations, bool normals);
std::string PlacesAloneWarning(const JobRequest& job);

// Of a scratch folder, for its points and its surface, bytes.
int64_t EstimateScratch(const JobRequest& job);

// Of a store, for what comes of its parts where several workers share them, bytes. `parts` is set.
int64_t EstimateKeptParts(const JobRequest& job);

}  // namespace rilievo
