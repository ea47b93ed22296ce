#include "server/postgres/postgres_schema.h"

#include <iterator>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

// A step is never changed once it was released; later ones are added behind it.
struct Migration {
  // Servers that know fewer steps than this may not work with the tables any more.
  int oldest_server;
  const char* sql;
};

// The first nine tables are those of server/store/job_tables.cc, column by column. `number` grows
// over all owners, `turn` over the jobs of one; `end_ms` is 0 while a job is not finished. Times in
// milliseconds are of the store's clock, the others of the database's.
constexpr Migration kMigrations[] = {{1, R"(
  CREATE TABLE jobs(
    number BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
    job_id BYTEA NOT NULL UNIQUE,
    owner BYTEA NOT NULL,
    turn BIGINT NOT NULL,
    request_id BYTEA NOT NULL,
    client BYTEA NOT NULL,
    scan BYTEA NOT NULL,
    mesh BYTEA NOT NULL,
    surface BYTEA NOT NULL,
    end_ms BIGINT NOT NULL,
    unclean_ends BIGINT NOT NULL,
    header BYTEA NOT NULL,
    job BYTEA NOT NULL,
    checksum BIGINT NOT NULL,
    UNIQUE(owner, request_id),
    UNIQUE(owner, turn));
  CREATE INDEX jobs_by_end ON jobs(end_ms);
  CREATE INDEX jobs_by_owner_and_end ON jobs(owner, end_ms, number);
  CREATE INDEX jobs_by_scan ON jobs(scan, owner);
  CREATE TABLE damaged(
    job_id BYTEA PRIMARY KEY, owner BYTEA NOT NULL, scan BYTEA NOT NULL, mesh BYTEA NOT NULL,
    surface BYTEA NOT NULL, since_ms BIGINT NOT NULL, header BYTEA NOT NULL, job BYTEA NOT NULL);
  CREATE TABLE scans(owner BYTEA NOT NULL, scan BYTEA NOT NULL, since_ms BIGINT NOT NULL,
    PRIMARY KEY(owner, scan));
  CREATE INDEX scans_by_age ON scans(owner, since_ms);
  CREATE INDEX scans_by_name ON scans(scan);
  CREATE TABLE uploads(name BYTEA PRIMARY KEY, owner BYTEA NOT NULL, bytes BIGINT NOT NULL,
    since_ms BIGINT NOT NULL);
  CREATE TABLE blobs(name BYTEA PRIMARY KEY, bytes BIGINT NOT NULL, since_ms BIGINT NOT NULL);
  CREATE TABLE uses(blob BYTEA NOT NULL, owner BYTEA NOT NULL, count BIGINT NOT NULL,
    PRIMARY KEY(blob, owner));
  CREATE TABLE owners(owner BYTEA PRIMARY KEY, bytes BIGINT NOT NULL);
  CREATE TABLE state(name BYTEA PRIMARY KEY, value BIGINT NOT NULL);

  -- Jobs that are not finished: who works on them (nobody: an empty name), until when.
  CREATE TABLE queue(
    number BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
    job_id BYTEA NOT NULL UNIQUE,
    client BYTEA NOT NULL,
    memory BIGINT NOT NULL,
    suspect BIGINT NOT NULL DEFAULT 0,
    worker BYTEA NOT NULL DEFAULT '',
    claim BIGINT NOT NULL DEFAULT 0,
    lease_until TIMESTAMPTZ,
    event BYTEA NOT NULL DEFAULT '') WITH (fillfactor = 50);
  CREATE INDEX queue_by_worker ON queue(worker);
  CREATE INDEX queue_waiting ON queue(client, number) WHERE worker = '';
  CREATE TABLE clients(client BYTEA PRIMARY KEY, last_turn BIGINT NOT NULL);
  CREATE SEQUENCE turns;
  CREATE TABLE workers(worker BYTEA PRIMARY KEY, memory BIGINT NOT NULL, seen TIMESTAMPTZ NOT NULL);

  -- Bytes of uploads, and of blobs that are kept here: as they came, not compressed once more.
  CREATE TABLE parts(name BYTEA NOT NULL, begins BIGINT NOT NULL, bytes BYTEA NOT NULL,
    since TIMESTAMPTZ NOT NULL DEFAULT now(), PRIMARY KEY(name, begins));
  ALTER TABLE parts ALTER bytes SET STORAGE EXTERNAL;
  CREATE TABLE upload_turns(name BYTEA PRIMARY KEY, turn BIGINT NOT NULL,
    busy_until TIMESTAMPTZ NOT NULL))"},
                                     {1, R"(
  -- Objects of an S3 bucket. Without a name it is not a blob: one that is being written (`upload`: in
  -- parts), was removed or set aside (`was`: its name), which goes in time.
  CREATE TABLE objects(
    key BYTEA PRIMARY KEY,
    name BYTEA UNIQUE,
    bytes BIGINT NOT NULL DEFAULT 0,
    upload BYTEA NOT NULL DEFAULT '',
    was BYTEA NOT NULL DEFAULT '',
    remove_after TIMESTAMPTZ);
  CREATE INDEX objects_to_remove ON objects(remove_after) WHERE remove_after IS NOT NULL)"},
                                     {1, R"(
  -- Parts of jobs that several workers share: who does them (nobody: an empty name), until when;
  -- `recipe`: the workers'
  -- version and limits; `result`: the blob that came of one; `twice`: to be done again, and compared.
  CREATE TABLE job_parts(
    job_id BYTEA NOT NULL,
    step BIGINT NOT NULL,
    part BIGINT NOT NULL,
    owner BYTEA NOT NULL,
    recipe BYTEA NOT NULL,
    worker BYTEA NOT NULL DEFAULT '',
    claim BIGINT NOT NULL DEFAULT 0,
    lease_until TIMESTAMPTZ,
    result BYTEA NOT NULL DEFAULT '',
    found_by BYTEA NOT NULL DEFAULT '',
    twice BIGINT NOT NULL,
    PRIMARY KEY(job_id, step, part)) WITH (fillfactor = 50);
  CREATE INDEX job_parts_by_worker ON job_parts(worker))"},
                                     {1, R"(
  -- In the order in which workers lock them, who go on meanwhile.
  LOCK TABLE queue, job_parts IN ACCESS EXCLUSIVE MODE;
  -- `twice` is 2 where the second result (`other`, by whom) is not the first; after a third one
  -- `other_by` is who was wrong.
  ALTER TABLE job_parts ADD other BYTEA NOT NULL DEFAULT '', ADD other_by BYTEA NOT NULL DEFAULT '';
  -- What is kept free for what comes of a job's parts, and what is left of that.
  ALTER TABLE queue ADD owner BYTEA NOT NULL DEFAULT '', ADD parts_bytes BIGINT NOT NULL DEFAULT 0;
  CREATE INDEX queue_by_owner ON queue(owner) WHERE parts_bytes > 0;
  CREATE VIEW reserved AS SELECT job_id, owner, greatest(0, parts_bytes - CAST((SELECT
    coalesce(sum(blobs.bytes), 0) FROM job_parts JOIN blobs ON blobs.name = job_parts.result
    WHERE job_parts.job_id = queue.job_id) AS BIGINT)) AS bytes FROM queue WHERE parts_bytes > 0)"}};

constexpr int64_t kVersion = std::size(kMigrations);

}  // namespace

absl::Status MakePostgresTables(Database* database) {
  return database->Transact([&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(database->Execute(
        "CREATE TABLE IF NOT EXISTS rilievo_schema(version BIGINT PRIMARY KEY, oldest_server BIGINT"
        " NOT NULL)"));
    RILIEVO_ASSIGN_OR_RETURN(
        const int64_t version,
        database->Number("SELECT COALESCE(MAX(version), 0) FROM rilievo_schema"));
    RILIEVO_ASSIGN_OR_RETURN(
        const int64_t oldest,
        database->Number("SELECT COALESCE(MAX(oldest_server), 0) FROM rilievo_schema"));
    if (oldest > kVersion) {
      return absl::UnavailableError(absl::StrCat(
          "the store is of version ", version, ", which servers below version ", oldest,
          " cannot use; this one is of version ", kVersion, ": use a newer rilievod"));
    }
    for (int64_t next = version + 1; next <= kVersion; ++next) {
      const Migration& step = kMigrations[next - 1];
      RILIEVO_RETURN_IF_ERROR(database->Execute(step.sql));
      RILIEVO_RETURN_IF_ERROR(database->Execute(
          absl::StrCat("INSERT INTO rilievo_schema VALUES(", next, ", ", step.oldest_server, ")")));
    }
    return absl::OkStatus();
  });
}

}  // namespace rilievo
