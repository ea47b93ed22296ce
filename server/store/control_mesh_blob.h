// Control meshes that clients give: too large for the record of a job, so blobs of their own.
#pragma once

#include <optional>

#include "absl/status/statusor.h"
#include "server/store/blob_folder.h"
#include "server/store/job_record.h"

namespace rilievo {

// Moves the mesh of the header, if it has one, to a staged blob, which `stored` then names.
absl::StatusOr<std::optional<BlobFolder::Staged>> TakeControlMesh(const BlobFolder& blobs,
                                                                  StoredJob* stored);

// The header as its client sent it. FAILED_PRECONDITION when the mesh is not there
// or not as it was.
absl::StatusOr<v1::ReconstructHeader> WholeHeader(const BlobFolder& blobs, const StoredJob& stored);

}  // namespace rilievo
