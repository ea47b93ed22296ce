#include "server/store/control_mesh_blob.h"

#include <string>
#include <vector>

#include "core/base/status_macros.h"
#include "server/store/content_name.h"

namespace rilievo {

absl::StatusOr<std::unique_ptr<StagedBlob>> TakeControlMesh(const BlobStore& blobs,
                                                            StoredJob* stored) {
  if (!stored->header.options().control().has_control_mesh()) return nullptr;
  v1::ControlOptions* control = stored->header.mutable_options()->mutable_control();
  const std::string bytes = control->control_mesh().SerializeAsString();
  RILIEVO_ASSIGN_OR_RETURN(auto staged, blobs.Stage({{bytes.begin(), bytes.end()}}));
  stored->mesh = staged->name();
  control->clear_control_mesh();
  return staged;
}

absl::StatusOr<v1::ReconstructHeader> WholeHeader(const BlobStore& blobs, const StoredJob& stored) {
  v1::ReconstructHeader header = stored.header;
  if (stored.mesh.empty()) return header;
  const absl::Status damaged = absl::FailedPreconditionError(
      "the control mesh of the job is damaged or lost; create the job again");
  const auto file = blobs.Read(stored.mesh);
  if (absl::IsNotFound(file.status()) || absl::IsDataLoss(file.status())) return damaged;
  RILIEVO_RETURN_IF_ERROR(file.status());
  RILIEVO_ASSIGN_OR_RETURN(const int64_t size, file->Size());
  std::string bytes(static_cast<size_t>(size), '\0');
  RILIEVO_RETURN_IF_ERROR(file->ReadAt(0, bytes.data(), bytes.size()));
  v1::ControlOptions* control = header.mutable_options()->mutable_control();
  if (ContentNameOf(bytes) != stored.mesh ||
      !control->mutable_control_mesh()->ParseFromString(bytes)) {
    return damaged;
  }
  return header;
}

}  // namespace rilievo
