// How the tables of a store come about: new, as they are, or written anew from older ones.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "server/store/blob_folder.h"
#include "server/store/job_tables.h"

namespace rilievo {

// Opens or makes `folder`/jobs.db. Tables of versions 1 and 2 are written anew, and the old file is
// kept beside as jobs.db.old until that has succeeded. UNAVAILABLE when the tables are of a later
// version; DATA_LOSS when the file is damaged, or missing though there are blobs: the message says
// what to do.
absl::StatusOr<JobTables> OpenTables(const std::string& folder, const BlobFolder& blobs);

struct RewriteResult {
  int64_t jobs = 0;
  int64_t damaged = 0;  // rows that were set aside, or could not be read
};

// Writes every row that can be read into new tables, which take the place of the old ones; these
// stay beside as jobs.db.old. Of any version up to this one.
absl::StatusOr<RewriteResult> RewriteTables(const std::string& folder, const BlobFolder& blobs);

}  // namespace rilievo
