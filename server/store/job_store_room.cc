// How a store stays within its retention, and makes room.
#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/conversion/call_error.h"
#include "server/store/job_store.h"

namespace rilievo {
namespace {

constexpr int kBatch = 200;  // rows of a transaction, so that calls come in between

}  // namespace

// Whether something of the owner's could go, and went.
absl::StatusOr<bool> JobStore::Evict(JobTables* tables, const std::string& owner,
                                     const Spared& spared) {
  RILIEVO_ASSIGN_OR_RETURN(const auto uploads, tables->UploadsOf(owner));
  for (const auto& upload : uploads) {
    if (upload.name == spared.upload) continue;
    RILIEVO_ASSIGN_OR_RETURN(const bool idle, uploads_->RemoveIfIdle(upload.name));
    if (!idle) continue;
    RILIEVO_RETURN_IF_ERROR(Free(tables, [&] { return tables->DropUpload(upload.name); }));
    return true;
  }
  RILIEVO_ASSIGN_OR_RETURN(const auto scan, tables->OldestIdleScan(owner, spared.scan));
  if (scan) {
    RILIEVO_RETURN_IF_ERROR(Free(tables, [&] { return tables->DropScan(owner, *scan).status(); }));
    return true;
  }
  RILIEVO_ASSIGN_OR_RETURN(const auto job, tables->OldestFinished(owner));
  if (!job) return false;
  RILIEVO_RETURN_IF_ERROR(
      Free(tables, [&] { return tables->Remove(*job, /*its_scan=*/false).status(); }));
  return true;
}

// For `bytes` more of `owner`: of who takes most, counting them; never of one that takes less.
absl::StatusOr<bool> JobStore::EvictForSize(JobTables* tables, const std::string& owner,
                                            int64_t bytes, const Spared& spared) {
  RILIEVO_ASSIGN_OR_RETURN(const int64_t own, tables->BytesOf(owner));
  RILIEVO_ASSIGN_OR_RETURN(const auto owners, tables->Owners());
  for (const auto& [other, taken] : owners) {
    if (taken < own + bytes) break;
    if (other == owner) continue;
    RILIEVO_ASSIGN_OR_RETURN(const bool evicted, Evict(tables, other, {}));
    if (evicted) return true;
  }
  return Evict(tables, owner, spared);
}

int64_t JobStore::BytesOfOwner() const {
  const Retention& keep = settings_.retention;
  return keep.owner_bytes > 0 ? std::min(keep.owner_bytes, keep.bytes) : keep.bytes;
}

absl::StatusOr<bool> JobStore::HasRoom(JobTables* tables, const std::string& owner, int64_t bytes) {
  RILIEVO_ASSIGN_OR_RETURN(const int64_t own, tables->BytesOf(owner));
  if (bytes > BytesOfOwner() - own) return false;
  RILIEVO_ASSIGN_OR_RETURN(const int64_t all, tables->BytesOfAll());
  // Where half of the store is free, what is there need not be counted row by row.
  if (bytes <= settings_.retention.bytes / 2 - all) return true;
  RILIEVO_ASSIGN_OR_RETURN(const int64_t total, tables->TotalBytes());
  return bytes <= settings_.retention.bytes - total;
}

absl::Status JobStore::CheckRoom(JobTables* tables, const std::string& owner, int64_t bytes,
                                 const Spared& spared) {
  RILIEVO_ASSIGN_OR_RETURN(const int64_t own, tables->BytesInUse(owner, spared.scan));
  RILIEVO_ASSIGN_OR_RETURN(const int64_t all, tables->BytesInUse(std::nullopt, spared.scan));
  const int64_t free = std::min(BytesOfOwner() - own, settings_.retention.bytes - all);
  if (bytes <= free) return absl::OkStatus();
  return StatusOf({ErrorCause::kStoreFull,
                   absl::StrCat("the store has no room: ", bytes,
                                " bytes are needed, and no more than ", std::max<int64_t>(0, free),
                                " can be had until other jobs are finished; send fewer points, or "
                                "try again then")});
}

absl::Status JobStore::MakeRoom(JobTables* tables, const std::string& owner, int64_t bytes,
                                const Spared& spared) {
  for (bool first = true;; first = false) {
    RILIEVO_ASSIGN_OR_RETURN(const bool has_room, HasRoom(tables, owner, bytes));
    if (has_room) return absl::OkStatus();
    if (first) RILIEVO_RETURN_IF_ERROR(CheckRoom(tables, owner, bytes, spared));
    RILIEVO_ASSIGN_OR_RETURN(const int64_t own, tables->BytesOf(owner));
    bool evicted = false;
    if (bytes > BytesOfOwner() - own) {
      RILIEVO_ASSIGN_OR_RETURN(evicted, Evict(tables, owner, spared));
    } else {
      RILIEVO_ASSIGN_OR_RETURN(const int64_t total, tables->TotalBytes());
      RILIEVO_RETURN_IF_ERROR(Free(tables, [&]() -> absl::Status {
        return tables->RemoveUnusedBlobs(INT64_MAX, kBatch).status();
      }));
      RILIEVO_ASSIGN_OR_RETURN(const int64_t used, tables->TotalBytes());
      if (used < total) continue;
      RILIEVO_ASSIGN_OR_RETURN(evicted, EvictForSize(tables, owner, bytes, spared));
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
    const auto tables = tables_->Take();
    const absl::Status removed = Free(tables.get(), [&]() -> absl::Status {
      RILIEVO_RETURN_IF_ERROR(KeepTime(tables.get()));
      RILIEVO_ASSIGN_OR_RETURN(more, tables->RemoveBefore(oldest, kBatch));
      return absl::OkStatus();
    });
    if (!removed.ok()) return removed;
  }
  const auto tables = tables_->Take();
  RILIEVO_ASSIGN_OR_RETURN(const auto uploads, tables->UploadsBefore(oldest));
  for (const auto& upload : uploads) {
    RILIEVO_ASSIGN_OR_RETURN(const bool idle, uploads_->RemoveIfIdle(upload.name));
    if (idle)
      RILIEVO_RETURN_IF_ERROR(Free(tables.get(), [&] { return tables->DropUpload(upload.name); }));
  }
  return absl::OkStatus();
}

absl::StatusOr<int64_t> JobStore::Clean() {
  RILIEVO_RETURN_IF_ERROR(RemoveOld());
  const Retention& keep = settings_.retention;
  for (bool more = true; more;) {
    const auto tables = tables_->Take();
    more = false;
    RILIEVO_ASSIGN_OR_RETURN(const auto owners, tables->Owners());
    RILIEVO_ASSIGN_OR_RETURN(const int64_t total, tables->TotalBytes());
    if (total > keep.bytes) {
      RILIEVO_RETURN_IF_ERROR(Free(
          tables.get(), [&] { return tables->RemoveUnusedBlobs(INT64_MAX, kBatch).status(); }));
      RILIEVO_ASSIGN_OR_RETURN(const int64_t used, tables->TotalBytes());
      more = used < total;
      if (more) continue;
    }
    for (const auto& [owner, taken] : owners) {
      const bool over = keep.owner_bytes > 0 && taken > keep.owner_bytes;
      if (!over && total <= keep.bytes) continue;
      RILIEVO_ASSIGN_OR_RETURN(more, Evict(tables.get(), owner, {}));
      if (more) break;
    }
  }
  int64_t stored = 0;
  {
    const auto tables = tables_->Take();
    if (shared_) {
      const auto clean = [&]() -> absl::Status {
        RILIEVO_RETURN_IF_ERROR(tables->DropLostParts());
        return JobQueue(&tables->database()).Clean();
      };
      RILIEVO_RETURN_IF_ERROR(Change(tables.get(), clean));
    }
    RILIEVO_RETURN_IF_ERROR(tables->database().Shrink());
    RILIEVO_ASSIGN_OR_RETURN(stored, tables->TotalBytes());
  }
  // Others need the tables meanwhile.
  RILIEVO_RETURN_IF_ERROR(blobs_->Sweep());
  return stored;
}

}  // namespace rilievo
