// Control meshes that clients give: too large for the record of a job, so blobs of their own.
#pragma once

#include <memory>

#include "absl/status/statusor.h"
#include "server/store/blob_store.h"
#include "server/store/job_record.h"

namespace rilievo {

// Moves the mesh of the header to a staged blob, which `stored` then names; null when it has none.
absl::StatusOr<std::unique_ptr<StagedBlob>> TakeControlMesh(const BlobStore& blobs,
                                                            StoredJob* stored);

// The header as its client sent it. FAILED_PRECONDITION when the mesh is not there
// or not as it was.
absl::StatusOr<v1::ReconstructHeader> WholeHeader(const BlobStore& blobs, const StoredJob& stored);

}  // namespace rilievo
