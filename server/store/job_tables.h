// The tables of a store: which jobs, scans and uploads there are, whose they are, and what each
// owner's take. No files are touched here.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/database.h"
#include "server/store/job_record.h"
#include "server/store/part_queue.h"
#include "server/store/sqlite_database.h"

namespace rilievo {

inline constexpr int kSchemaVersion = 3;

// Blobs are counted: `uses` says how often an owner needs one (its scans, the scans and meshes of
// its unfinished jobs, the surfaces of its finished ones), `owners` what all of an owner takes. Who
// drops the last use of a blob makes it one of gone(). Used by one thread at a time.
class JobTables {
 public:
  // Of a database that has the tables: of kSchemaVersion, or shared.
  explicit JobTables(std::unique_ptr<Database> database) : database_(std::move(database)) {}
  explicit JobTables(SqliteDatabase database)
      : database_(std::make_unique<SqliteDatabase>(std::move(database))) {}

  static absl::Status Make(SqliteDatabase* database);

  Database& database() { return *database_; }

  // `body` as one transaction. Functions that change something are called within one.
  absl::Status Transact(const std::function<absl::Status()>& body);

  // `body` while no transaction of anybody changes the tables; it changes nothing itself.
  absl::Status Alone(const std::function<absl::Status()>& body);

  // Blobs that nobody uses since the latest transaction.
  std::vector<std::string> TakeGone() { return std::exchange(gone_, {}); }

  // Rows that are damaged are moved to the table of that name as they are met, and told of by
  // TakeDamaged(); to all else they are not there.
  absl::StatusOr<std::optional<StoredJob>> Find(const std::string& job_id);
  absl::StatusOr<std::optional<StoredJob>> Find(const std::string& owner,
                                                const std::string& request_id);
  // As JobStore's.
  absl::StatusOr<std::vector<StoredJob>> List(const std::string& owner, int limit, int64_t* before);
  absl::StatusOr<std::vector<StoredJob>> Unfinished();
  // The next jobs after a number, which is set for the next call, to 0 after the last one.
  absl::StatusOr<std::vector<StoredJob>> After(int64_t* number, int limit);
  // One whose record is right but whose surface is not; in a transaction of its own.
  absl::Status SetAside(const std::string& job_id);
  // Ids of the damaged rows found since the last call.
  std::vector<std::string> TakeDamaged() { return std::exchange(damaged_, {}); }
  absl::StatusOr<bool> IsDamaged(const std::string& owner, const std::string& job_id);
  absl::Status ForgetDamaged(const std::string& job_id);

  absl::Status Insert(const StoredJob& stored, int64_t end_ms, int64_t now_ms);
  // False when the job is finished or not there, or names a claim that is not in force.
  absl::StatusOr<bool> Update(const StoredJob& stored, int64_t now_ms);
  // False when it is not there. With `its_scan`, its owner's scan too, unless another job of the
  // owner names it.
  absl::StatusOr<bool> Remove(const std::string& job_id, bool its_scan);

  absl::Status AddBlob(const std::string& name, int64_t bytes, int64_t now_ms);
  absl::Status ForgetBlob(const std::string& name);
  absl::StatusOr<std::vector<std::string>> BlobNames();
  // -1 when there is none.
  absl::StatusOr<int64_t> BytesOfBlob(const std::string& name);

  absl::Status AddScan(const std::string& owner, const std::string& scan, int64_t now_ms);
  absl::StatusOr<bool> HasScan(const std::string& owner, const std::string& scan);
  // False when the scan does not belong to the owner.
  absl::StatusOr<bool> DropScan(const std::string& owner, const std::string& scan);
  // For all of its owners.
  absl::Status ForgetScan(const std::string& scan);

  // What came of a part of an unfinished job of the owner's: it goes with the job's other needs.
  absl::Status UsePart(const std::string& owner, const std::string& blob) {
    return Use(owner, blob);
  }
  absl::Status DropPart(const std::string& owner, const std::string& blob) {
    return Drop(owner, blob);
  }
  // Whether it counts as the owner's already.
  absl::StatusOr<bool> Uses(const std::string& owner, const std::string& blob);
  // Forgets all parts of a job that are by other recipes, which the worker that leads does again.
  absl::Status DropPartsOfOthers(const PartWorker& leader);
  // Those of jobs that are not there: servers of an older version know no parts.
  absl::Status DropLostParts();

  // An upload counts with all that was announced of it.
  absl::Status PutUpload(const std::string& owner, const std::string& name, int64_t bytes,
                         int64_t now_ms);
  absl::Status DropUpload(const std::string& name);

  struct Upload {
    std::string name;
    int64_t bytes = 0;
  };
  absl::StatusOr<std::optional<Upload>> FindUpload(const std::string& name);
  // Oldest first; of an owner, or those since before `since_ms`.
  absl::StatusOr<std::vector<Upload>> UploadsOf(const std::string& owner);
  absl::StatusOr<std::vector<Upload>> UploadsBefore(int64_t since_ms);

  // Bytes of blobs, records, announced uploads and what is kept free for parts. Reads all rows.
  absl::StatusOr<int64_t> TotalBytes();
  // Of what owners have, all that several have counted for each: at least TotalBytes() but for
  // blobs that nobody uses, as a crash leaves them.
  absl::StatusOr<int64_t> BytesOfAll();
  absl::StatusOr<int64_t> BytesOf(const std::string& owner);
  // What unfinished jobs need, and `scan` ("": none), each blob once, and what is kept free for
  // parts; of `owner`, or of all. No eviction gives any of it.
  absl::StatusOr<int64_t> BytesInUse(const std::optional<std::string>& owner,
                                     const std::string& scan);
  // Largest first.
  absl::StatusOr<std::vector<std::pair<std::string, int64_t>>> Owners();
  // What is left of what is kept free for the parts of a job; of a shared database.
  absl::StatusOr<int64_t> BytesReserved(const std::string& job_id);

  // The oldest scan but `except` that no unfinished job of the owner needs, and the job that was
  // finished first.
  absl::StatusOr<std::optional<std::string>> OldestIdleScan(const std::string& owner,
                                                            const std::string& except);
  absl::StatusOr<std::optional<std::string>> OldestFinished(const std::string& owner);

  // Removes what ended, was used or was found before `time_ms`, at most `limit` of each; whether
  // there is more. Uploads are left to the caller, as their files are.
  absl::StatusOr<bool> RemoveBefore(int64_t time_ms, int limit);

  // The part of it that is about blobs which nobody uses, as crashes leave them.
  absl::StatusOr<bool> RemoveUnusedBlobs(int64_t time_ms, int limit);

  // Counts uses and owners anew from the rows. A no-op unless something was damaged.
  absl::Status Recount();

  absl::StatusOr<int64_t> State(const std::string& name);
  absl::Status SetState(const std::string& name, int64_t value);

 private:
  absl::StatusOr<std::vector<std::pair<int64_t, StoredJob>>> Read(
      const std::string& where, const std::function<void(Query*)>& bind);
  absl::Status SetAside(const std::vector<std::pair<int64_t, std::string>>& rows);
  absl::Status Use(const std::string& owner, const std::string& blob);
  // Once more, of what the owner uses already.
  absl::Status UseAgain(const std::string& owner, const std::string& blob);
  absl::Status Drop(const std::string& owner, const std::string& blob);
  // Forgets the parts of which `where` holds, and what came of them.
  absl::Status DropParts(const std::string& where, const std::function<void(Query*)>& bind);
  absl::Status AddBytes(const std::string& owner, int64_t bytes);
  std::string Reserved(const std::string& where) const;
  // What an unfinished job needs.
  absl::Status UseInputs(const StoredJob& stored);
  absl::Status DropInputs(const StoredJob& stored);
  absl::StatusOr<std::vector<std::string>> Names(const std::string& sql,
                                                 const std::function<void(Query*)>& bind);

  std::unique_ptr<Database> database_;
  std::vector<std::string> gone_;
  std::vector<std::string> damaged_;
};

}  // namespace rilievo
