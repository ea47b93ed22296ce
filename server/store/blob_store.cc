#include "server/store/blob_store.h"

#include "core/base/status_macros.h"

namespace rilievo {

absl::StatusOr<std::unique_ptr<StagedBlob>> BlobStore::Stage(
    const std::vector<std::vector<uint8_t>>& parts) const {
  auto part = parts.begin();
  return StageFrom([&]() -> absl::StatusOr<std::string_view> {
    while (part != parts.end() && part->empty()) ++part;
    if (part == parts.end()) return std::string_view();
    const std::string_view bytes(reinterpret_cast<const char*>(part->data()), part->size());
    ++part;
    return bytes;
  });
}

absl::StatusOr<std::string> BlobStore::Put(const std::vector<std::vector<uint8_t>>& parts) const {
  RILIEVO_ASSIGN_OR_RETURN(const auto staged, Stage(parts));
  RILIEVO_RETURN_IF_ERROR(staged->Adopt(nullptr));
  return staged->name();
}

}  // namespace rilievo
