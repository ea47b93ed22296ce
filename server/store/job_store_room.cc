// How a store stays within its retention, and makes room.
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/store/job_store.h"

namespace rilievo {
namespace {

constexpr int kBatch = 200;  // rows of a transaction, so that calls come in between

}  // namespace

// Whether something of the owner's could go, and went.
absl::StatusOr<bool> JobStore::Evict(const std::string& owner, const std::string& except_upload) {
  RILIEVO_ASSIGN_OR_RETURN(const auto uploads, tables_.UploadsOf(owner));
  for (const auto& upload : uploads) {
    if (upload.name == except_upload) continue;
    RILIEVO_ASSIGN_OR_RETURN(const bool idle, uploads_->RemoveIfIdle(upload.name));
    if (!idle) continue;
    RILIEVO_RETURN_IF_ERROR(Free([&] { return tables_.DropUpload(upload.name); }));
    return true;
  }
  RILIEVO_ASSIGN_OR_RETURN(const auto scan, tables_.OldestIdleScan(owner));
  if (scan) {
    RILIEVO_RETURN_IF_ERROR(Free([&] { return tables_.DropScan(owner, *scan).status(); }));
    return true;
  }
  RILIEVO_ASSIGN_OR_RETURN(const auto job, tables_.OldestFinished(owner));
  if (!job) return false;
  RILIEVO_RETURN_IF_ERROR(Free([&] { return tables_.Remove(*job, /*its_scan=*/false).status(); }));
  return true;
}

// For `bytes` more of `owner`: of who takes most, counting them; never of one that takes less.
absl::StatusOr<bool> JobStore::EvictForSize(const std::string& owner, int64_t bytes,
                                            const std::string& for_upload) {
  RILIEVO_ASSIGN_OR_RETURN(const int64_t own, tables_.BytesOf(owner));
  RILIEVO_ASSIGN_OR_RETURN(const auto owners, tables_.Owners());
  for (const auto& [other, taken] : owners) {
    if (taken < own + bytes) break;
    if (other == owner) continue;
    RILIEVO_ASSIGN_OR_RETURN(const bool evicted, Evict(other, ""));
    if (evicted) return true;
  }
  return Evict(owner, for_upload);
}

absl::Status JobStore::MakeRoom(const std::string& owner, int64_t bytes,
                                const std::string& for_upload) {
  const Retention& keep = settings_.retention;
  const int64_t limit = keep.owner_bytes > 0 ? keep.owner_bytes : keep.bytes;
  if (bytes > std::min(limit, keep.bytes)) {
    return absl::ResourceExhaustedError(
        absl::StrCat(bytes, " bytes are more than the store holds"));
  }
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const int64_t own, tables_.BytesOf(owner));
    RILIEVO_ASSIGN_OR_RETURN(const int64_t total, tables_.TotalBytes());
    bool evicted = false;
    if (own + bytes > limit) {
      RILIEVO_ASSIGN_OR_RETURN(evicted, Evict(owner, for_upload));
    } else if (total + bytes > keep.bytes) {
      RILIEVO_RETURN_IF_ERROR(Free(
          [&]() -> absl::Status { return tables_.RemoveUnusedBlobs(INT64_MAX, kBatch).status(); }));
      RILIEVO_ASSIGN_OR_RETURN(const int64_t used, tables_.TotalBytes());
      if (used < total) continue;
      RILIEVO_ASSIGN_OR_RETURN(evicted, EvictForSize(owner, bytes, for_upload));
    } else {
      return absl::OkStatus();
    }
    if (!evicted) {
      return absl::ResourceExhaustedError(
          absl::StrCat("the store has no room for ", bytes, " bytes more of this owner"));
    }
  }
}

absl::Status JobStore::RemoveOld() {
  const int64_t oldest = clock_.Now() - settings_.retention.age_ms;
  for (bool more = true; more;) {
    const std::lock_guard lock(mutex_);
    const absl::Status removed = Free([&]() -> absl::Status {
      RILIEVO_RETURN_IF_ERROR(KeepTime());
      RILIEVO_ASSIGN_OR_RETURN(more, tables_.RemoveBefore(oldest, kBatch));
      return absl::OkStatus();
    });
    if (!removed.ok()) return removed;
  }
  const std::lock_guard lock(mutex_);
  RILIEVO_ASSIGN_OR_RETURN(const auto uploads, tables_.UploadsBefore(oldest));
  for (const auto& upload : uploads) {
    RILIEVO_ASSIGN_OR_RETURN(const bool idle, uploads_->RemoveIfIdle(upload.name));
    if (idle) RILIEVO_RETURN_IF_ERROR(Free([&] { return tables_.DropUpload(upload.name); }));
  }
  return absl::OkStatus();
}

absl::StatusOr<int64_t> JobStore::Clean() {
  RILIEVO_RETURN_IF_ERROR(RemoveOld());
  const Retention& keep = settings_.retention;
  for (bool more = true; more;) {
    const std::lock_guard lock(mutex_);
    more = false;
    RILIEVO_ASSIGN_OR_RETURN(const auto owners, tables_.Owners());
    RILIEVO_ASSIGN_OR_RETURN(const int64_t total, tables_.TotalBytes());
    if (total > keep.bytes) {
      RILIEVO_RETURN_IF_ERROR(
          Free([&] { return tables_.RemoveUnusedBlobs(INT64_MAX, kBatch).status(); }));
      RILIEVO_ASSIGN_OR_RETURN(const int64_t used, tables_.TotalBytes());
      more = used < total;
      if (more) continue;
    }
    for (const auto& [owner, taken] : owners) {
      const bool over = keep.owner_bytes > 0 && taken > keep.owner_bytes;
      if (!over && total <= keep.bytes) continue;
      RILIEVO_ASSIGN_OR_RETURN(more, Evict(owner, ""));
      if (more) break;
    }
  }
  const std::lock_guard lock(mutex_);
  RILIEVO_RETURN_IF_ERROR(tables_.database().Shrink());
  return tables_.TotalBytes();
}

}  // namespace rilievo
