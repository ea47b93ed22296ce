#include "server/store/store_check.h"

#include <fcntl.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/sha256.h"
#include "core/base/status_macros.h"
#include "server/store/content_name.h"
#include "server/store/folder.h"
#include "server/store/store_clock.h"
#include "server/store/store_tables.h"

namespace rilievo {
namespace {

constexpr int kJobsAtOnce = 500;

absl::StatusOr<std::string> NameOf(const FileDescriptor& file) {
  RILIEVO_ASSIGN_OR_RETURN(const int64_t size, file.Size());
  Sha256 hash;
  std::string block;
  for (int64_t at = 0; at < size; at += static_cast<int64_t>(block.size())) {
    block.resize(static_cast<size_t>(std::min<int64_t>(1 << 20, size - at)));
    RILIEVO_RETURN_IF_ERROR(file.ReadAt(at, block.data(), block.size()));
    AddBytes(block.data(), block.size(), &hash);
  }
  return ContentName(hash);
}

class Check {
 public:
  Check(JobTables tables, BlobFolder blobs, bool repair,
        const std::function<void(const std::string&)>& report)
      : tables_(std::move(tables)), blobs_(std::move(blobs)), repair_(repair), report_(report) {}

  absl::StatusOr<int64_t> Run() {
    RILIEVO_RETURN_IF_ERROR(CheckBlobs());
    RILIEVO_RETURN_IF_ERROR(CheckJobs());
    RILIEVO_RETURN_IF_ERROR(ForgetLost());
    return left_;
  }

 private:
  void Problem(const std::string& what, const std::string& remedy) {
    report_(absl::StrCat(what, repair_ ? ": " : "; --repair: ", remedy));
    left_ += !repair_;
  }

  // Fills in the blobs that are whole.
  absl::Status CheckBlobs() {
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<FileEntry> files, blobs_.List());
    for (const FileEntry& entry : files) {
      const auto file = blobs_.Read(entry.name);
      const auto name = file.ok() ? NameOf(*file) : file.status();
      if (name.ok() && *name == entry.name) {
        whole_.insert(entry.name);
        continue;
      }
      Problem(absl::StrCat("blobs/", entry.name, " is damaged"), "moved to the folder damaged");
      if (repair_) RILIEVO_RETURN_IF_ERROR(blobs_.SetAside(entry.name));
    }
    return absl::OkStatus();
  }

  absl::Status CheckJobs() {
    for (int64_t number = 0;;) {
      RILIEVO_ASSIGN_OR_RETURN(const auto jobs, tables_.After(&number, kJobsAtOnce));
      for (const std::string& id : tables_.TakeDamaged()) {
        report_(absl::StrCat("job ", id, ": its record was damaged and is set aside"));
      }
      for (const StoredJob& stored : jobs) {
        if (stored.surface.empty() || whole_.contains(stored.surface)) continue;
        Problem(absl::StrCat("job ", stored.job.job_id(), ": its surface is damaged or lost"),
                "its client is told to create it again");
        if (repair_) RILIEVO_RETURN_IF_ERROR(tables_.SetAside(stored.job.job_id()));
      }
      if (number == 0) return absl::OkStatus();
    }
  }

  // Scans and other blobs that the tables name, and are not there.
  absl::Status ForgetLost() {
    RILIEVO_ASSIGN_OR_RETURN(const auto names, tables_.BlobNames());
    std::vector<std::string> lost;
    for (const std::string& name : names) {
      if (whole_.contains(name)) continue;
      lost.push_back(name);
      Problem(absl::StrCat("blobs/", name, " is not there or not whole"),
              "forgotten until it is sent again");
    }
    if (!repair_) return absl::OkStatus();
    return tables_.Transact([&]() -> absl::Status {
      for (const std::string& name : lost) {
        RILIEVO_RETURN_IF_ERROR(tables_.ForgetScan(name));
        RILIEVO_RETURN_IF_ERROR(tables_.ForgetBlob(name));
      }
      return tables_.Recount();
    });
  }

  JobTables tables_;
  const BlobFolder blobs_;
  const bool repair_;
  const std::function<void(const std::string&)>& report_;
  std::set<std::string> whole_;
  int64_t left_ = 0;
};

}  // namespace

absl::StatusOr<int64_t> CheckStore(const std::string& folder, bool repair,
                                   const std::function<void(const std::string&)>& report) {
  if (!std::filesystem::is_directory(folder)) {
    return absl::NotFoundError(absl::StrCat(folder, " is not a folder; give the one of --store"));
  }
  RILIEVO_ASSIGN_OR_RETURN(const FileDescriptor lock, LockFolder(folder));
  RILIEVO_ASSIGN_OR_RETURN(BlobFolder blobs, BlobFolder::Open(folder + "/blobs"));
  absl::StatusOr<JobTables> tables = OpenTables(folder, blobs);
  if (absl::IsDataLoss(tables.status())) {
    report(std::string(tables.status().message()));
    if (!repair) return 1;
    RILIEVO_ASSIGN_OR_RETURN(const RewriteResult saved, RewriteTables(folder, blobs));
    report(absl::StrCat(saved.jobs, " jobs were saved, ", saved.damaged, " records were damaged; ",
                        "the old file is jobs.db.old"));
    tables = OpenTables(folder, blobs);
  }
  RILIEVO_RETURN_IF_ERROR(tables.status());
  // Records that are set aside are so since now.
  RILIEVO_RETURN_IF_ERROR(tables->Transact([&]() -> absl::Status {
    const auto since = tables->State("store_ms");
    if (!since.ok() || *since != 0) return since.status();
    return tables->SetState("store_ms", StoreClock::System().wall_ms());
  }));
  return Check(*std::move(tables), std::move(blobs), repair, report).Run();
}

}  // namespace rilievo
