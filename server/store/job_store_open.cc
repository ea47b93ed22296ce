// How a store begins and ends.
#include <sys/stat.h>

#include <algorithm>
#include <set>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/store/blob_folder.h"
#include "server/store/folder.h"
#include "server/store/job_store.h"
#include "server/store/partial_uploads.h"
#include "server/store/store_tables.h"

namespace rilievo {
namespace {

constexpr char kStoreTime[] = "store_ms", kWallTime[] = "wall_ms";

}  // namespace

absl::StatusOr<std::unique_ptr<JobStore>> JobStore::Open(const std::string& folder,
                                                         StoreSettings settings) {
  if (absl::StrContains(folder, "://")) {
    return absl::InvalidArgumentError(
        "store: this program keeps jobs in a folder only; rilievod takes postgres://...");
  }
  RILIEVO_RETURN_IF_ERROR(MakeFolder(folder));
  StoreParts parts;
  RILIEVO_ASSIGN_OR_RETURN(parts.lock, LockFolder(folder));
  RILIEVO_ASSIGN_OR_RETURN(BlobFolder blobs, BlobFolder::Open(folder + "/blobs"));
  RILIEVO_ASSIGN_OR_RETURN(JobTables tables, OpenTables(folder, blobs));
  RILIEVO_ASSIGN_OR_RETURN(parts.uploads, PartialUploads::Open(folder + "/uploads", blobs));
  RILIEVO_RETURN_IF_ERROR(SyncFolder(folder));
  std::vector<std::unique_ptr<JobTables>> one;
  one.push_back(std::make_unique<JobTables>(std::move(tables)));
  parts.tables = std::make_unique<LeasePool<JobTables>>(std::move(one));
  parts.blobs = std::make_unique<BlobFolder>(std::move(blobs));
  parts.room = std::make_unique<DiskRoom>(folder);
  parts.clock = settings.clock.value_or(StoreClock::System());
  struct stat rights {};
  if (stat(folder.c_str(), &rights) == 0 && (rights.st_mode & 077) != 0 && settings.report) {
    settings.report(absl::StrCat(folder, " is open to others than its owner; chmod 700 it"));
  }
  return Open(std::move(parts), std::move(settings));
}

absl::StatusOr<std::unique_ptr<JobStore>> JobStore::Open(StoreParts parts, StoreSettings settings) {
  int64_t store_ms, wall_ms;
  {
    const auto tables = parts.tables->Take();
    RILIEVO_ASSIGN_OR_RETURN(store_ms, tables->State(kStoreTime));
    RILIEVO_ASSIGN_OR_RETURN(wall_ms, tables->State(kWallTime));
  }
  const StoreClock clock(store_ms, wall_ms, parts.clock);
  std::unique_ptr<JobStore> store(new JobStore(std::move(parts), std::move(settings), clock));
  const auto tables = store->tables_->Take();
  RILIEVO_RETURN_IF_ERROR(store->Reconcile(tables.get()));
  return store;
}

JobStore::JobStore(StoreParts parts, StoreSettings settings, const StoreClock& clock)
    : shared_(parts.shared),
      lock_(std::move(parts.lock)),
      settings_(std::move(settings)),
      clock_(clock),
      tables_(std::move(parts.tables)),
      blobs_(std::move(parts.blobs)),
      uploads_(std::move(parts.uploads)),
      room_(std::move(parts.room)) {}

JobStore::~JobStore() {
  const auto tables = tables_->Take();
  Change(tables.get(), [&] { return KeepTime(tables.get()); }).IgnoreError();
  tables->database().Shrink().IgnoreError();
}

// Another server may have come further.
absl::Status JobStore::KeepTime(JobTables* tables) {
  RILIEVO_ASSIGN_OR_RETURN(const int64_t kept, tables->State(kStoreTime));
  RILIEVO_RETURN_IF_ERROR(
      tables->SetState(kStoreTime, shared_ ? std::max(kept, clock_.Now()) : clock_.Now()));
  return tables->SetState(kWallTime, clock_.Wall());
}

absl::Status JobStore::Reconcile(JobTables* tables) {
  // A store on a full disk opens too: what is stored can be read and removed.
  const absl::Status done = Change(tables, [&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(KeepTime(tables));
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<FileEntry> files, blobs_->List());
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<std::string> names, tables->BlobNames());
    const std::set<std::string> known(names.begin(), names.end());
    for (const FileEntry& file : files) {
      if (known.contains(file.name)) continue;
      RILIEVO_RETURN_IF_ERROR(tables->AddBlob(file.name, file.bytes, clock_.Now()));
    }
    return ReconcileUploads(tables);
  });
  if (room_) room_->Note(done);
  return absl::IsResourceExhausted(done) ? absl::OkStatus() : done;
}

absl::Status JobStore::ReconcileUploads(JobTables* tables) {
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<FileEntry> uploads, uploads_->List());
  std::set<std::string> there;
  for (const FileEntry& file : uploads) {
    there.insert(file.name);
    RILIEVO_ASSIGN_OR_RETURN(const auto known, tables->FindUpload(file.name));
    if (known) continue;
    RILIEVO_RETURN_IF_ERROR(tables->PutUpload("", file.name, file.bytes, clock_.Now()));
  }
  // At another server one that is announced may be about to begin.
  if (shared_) return absl::OkStatus();
  RILIEVO_ASSIGN_OR_RETURN(const auto announced, tables->UploadsBefore(INT64_MAX));
  for (const auto& upload : announced) {
    if (!there.contains(upload.name)) RILIEVO_RETURN_IF_ERROR(tables->DropUpload(upload.name));
  }
  return absl::OkStatus();
}

}  // namespace rilievo
