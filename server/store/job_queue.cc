#include "server/store/job_queue.h"

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

// Whether a worker of that memory, which works on nothing else or not, may take a row's job.
std::string Fits(const std::string& memory, const std::string& idle) {
  return absl::StrCat("(memory <= ", memory, " OR ", idle, " = 1 AND ", memory,
                      " >= (SELECT MAX(memory) FROM workers WHERE seen > now() - ", kLease, "))");
}

// Of those who wait, the first ones of each client; of them the first in turn.
const std::string& NextInTurn() {
  static const std::string sql = absl::StrCat(
      R"(SELECT waiting.number FROM queue AS waiting JOIN (
          SELECT ahead.number, clients.last_turn FROM clients CROSS JOIN LATERAL (
            SELECT number FROM queue
            WHERE queue.client = clients.client AND worker = '' AND suspect = 0 AND )",
      Fits("$2", "$3"), R"(
            ORDER BY number LIMIT $4) AS ahead) AS heads ON heads.number = waiting.number
        WHERE waiting.worker = '' ORDER BY heads.last_turn, waiting.number
        LIMIT 1 FOR UPDATE OF waiting SKIP LOCKED)");
  return sql;
}

const std::string& NextSuspect() {
  static const std::string sql =
      absl::StrCat("SELECT number FROM queue WHERE worker = '' AND suspect = 1 AND $3 = 1 AND ",
                   Fits("$2", "$3"), " ORDER BY number LIMIT 1 FOR UPDATE SKIP LOCKED");
  return sql;
}

}  // namespace

absl::Status JobQueue::Insert(const StoredJob& stored) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_->Prepare("INSERT INTO queue(job_id, client, memory, owner,"
                                              " parts_bytes) VALUES($1, $2, $3, $4, $5)"));
  query.Bind(stored.job.job_id()).Bind(stored.client).Bind(stored.memory);
  RILIEVO_RETURN_IF_ERROR(query.Bind(stored.owner).Bind(stored.parts_bytes).Post());
  // Behind those who are waiting.
  RILIEVO_ASSIGN_OR_RETURN(Query turn,
                           database_->Prepare("INSERT INTO clients VALUES($1, nextval('turns'))"
                                              " ON CONFLICT(client) DO NOTHING"));
  return turn.Bind(stored.client).Post();
}

absl::Status JobQueue::Remove(const std::string& job_id) {
  RILIEVO_ASSIGN_OR_RETURN(Query query, database_->Prepare("DELETE FROM queue WHERE job_id = $1"));
  return query.Bind(job_id).Post();
}

absl::StatusOr<std::optional<JobClaim>> JobQueue::Claim(const ClaimDemand& demand) {
  // Each time more of each client: others may be at the first ones just now, or have taken them
  // since this statement began to look.
  for (const int64_t heads : {8, 64, 512, 4096, 32768}) {
    std::optional<JobClaim> taken;
    const absl::Status done = database_->TransactUnflushed([&]() -> absl::Status {
      RILIEVO_ASSIGN_OR_RETURN(taken, Take(NextInTurn(), demand, heads));
      if (taken || !demand.idle) return absl::OkStatus();
      RILIEVO_ASSIGN_OR_RETURN(taken, Take(NextSuspect(), demand, heads));
      return absl::OkStatus();
    });
    if (!done.ok()) return done;
    if (taken) return taken;
    RILIEVO_ASSIGN_OR_RETURN(const bool waits, Waits(demand));
    if (!waits) break;
  }
  return std::nullopt;
}

absl::StatusOr<bool> JobQueue::Waits(const ClaimDemand& demand) {
  static const std::string sql =
      absl::StrCat("SELECT 1 FROM queue WHERE worker = '' AND (suspect = 0 OR $2 = 1) AND ",
                   Fits("$1", "$2"), " LIMIT 1");
  RILIEVO_ASSIGN_OR_RETURN(Query query, database_->Prepare(sql));
  return query.Bind(demand.memory).Bind(int64_t{demand.idle}).Step();
}

absl::StatusOr<std::optional<JobClaim>> JobQueue::Take(const std::string& number,
                                                       const ClaimDemand& demand, int64_t heads) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query,
      database_->Prepare(absl::StrCat("UPDATE queue SET worker = $1, claim = claim + 1, event = '',"
                                      " lease_until = now() + ",
                                      kLease, " WHERE number = (", number,
                                      ") RETURNING job_id, claim, client, memory")));
  query.Bind(demand.worker).Bind(demand.memory).Bind(int64_t{demand.idle}).Bind(heads);
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Step());
  if (!found) return std::nullopt;
  RILIEVO_ASSIGN_OR_RETURN(Query turn,
                           database_->Prepare("INSERT INTO clients VALUES($1, nextval('turns')) ON"
                                              " CONFLICT(client) DO UPDATE SET last_turn ="
                                              " excluded.last_turn"));
  RILIEVO_RETURN_IF_ERROR(turn.Bind(query.Bytes(2)).Post());
  return JobClaim{query.Bytes(0), query.Integer(1), demand.worker, query.Integer(3)};
}

absl::Status JobQueue::Lock(const std::string& job_id) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_->Prepare("SELECT 1 FROM queue WHERE job_id = $1 FOR UPDATE"));
  return query.Bind(job_id).Post();
}

absl::Status JobQueue::Release(const JobClaim& claim, bool suspect, bool last) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query,
      database_->Prepare(absl::StrCat(
          "UPDATE queue SET worker = '', lease_until = NULL, event = '', suspect = $4",
          last ? ", number = DEFAULT" : "", " WHERE job_id = $1 AND claim = $2 AND worker = $3")));
  query.Bind(claim.job_id).Bind(claim.number).Bind(claim.worker);
  return query.Bind(int64_t{suspect}).Post();
}

absl::StatusOr<std::vector<JobClaim>> JobQueue::Renew(const ClaimDemand& worker, int64_t* freed) {
  std::vector<JobClaim> claims;
  const absl::Status done = database_->TransactUnflushed([&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(
        Query seen, database_->Prepare("INSERT INTO workers VALUES($1, $2, now()) ON"
                                       " CONFLICT(worker) DO UPDATE SET memory = excluded.memory,"
                                       " seen = now() WHERE workers.seen < now() - interval '5"
                                       " seconds'"));
    RILIEVO_RETURN_IF_ERROR(seen.Bind(worker.worker).Bind(worker.memory).Post());
    RILIEVO_ASSIGN_OR_RETURN(claims, RenewLeases(worker.worker));
    RILIEVO_ASSIGN_OR_RETURN(*freed, FreeLost());
    return absl::OkStatus();
  });
  if (!done.ok()) return done;
  return claims;
}

absl::StatusOr<std::vector<JobClaim>> JobQueue::RenewLeases(const std::string& worker) {
  RILIEVO_ASSIGN_OR_RETURN(Query query, database_->Prepare(absl::StrCat(
                                            "UPDATE queue SET lease_until = now() + ", kLease,
                                            " WHERE worker = $1 RETURNING job_id, claim")));
  query.Bind(worker);
  std::vector<JobClaim> claims;
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) return claims;
    claims.push_back({.job_id = query.Bytes(0), .number = query.Integer(1), .worker = worker});
  }
}

// In the order of their numbers, as whoever renews several leases locks them. Whoever takes one
// that had begun counts an unclean end: by then it may have to be alone.
absl::StatusOr<int64_t> JobQueue::FreeLost() {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query,
      database_->Prepare(absl::StrCat(
          "UPDATE queue SET worker = '', lease_until = NULL, event = '', suspect = CASE WHEN"
          " EXISTS(SELECT 1 FROM jobs WHERE jobs.job_id = queue.job_id AND unclean_ends >= ",
          kSuspectEnds - 1,
          ") THEN 1 ELSE suspect END WHERE number IN (SELECT"
          " number FROM queue WHERE worker <> '' AND lease_until < now() AND"
          " pg_postmaster_start_time() < now() - ",
          kLease, " ORDER BY number FOR UPDATE SKIP LOCKED)")));
  RILIEVO_RETURN_IF_ERROR(query.Run());
  return database_->Changes();
}

absl::Status JobQueue::Tell(const JobClaim& claim, const std::string& event) {
  return database_->TransactUnflushed([&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(
        Query query,
        database_->Prepare("UPDATE queue SET event = $4 WHERE job_id = $1 AND claim = $2 AND"
                           " worker = $3"));
    return query.Bind(claim.job_id).Bind(claim.number).Bind(claim.worker).Bind(event).Post();
  });
}

absl::StatusOr<std::string> JobQueue::LatestEvent(const std::string& job_id) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_->Prepare("SELECT event FROM queue WHERE job_id = $1"));
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(job_id).Step());
  return found ? query.Bytes(0) : "";
}

absl::StatusOr<JobQueue::Counts> JobQueue::Count(const std::string& client) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query,
      database_->Prepare(absl::StrCat("SELECT COUNT(*), COUNT(*) FILTER (WHERE client = $1),"
                                      " COUNT(*) FILTER (WHERE worker = ''), (SELECT COUNT(*) FROM"
                                      " workers WHERE seen > now() - ",
                                      kLease, ") FROM queue")));
  RILIEVO_RETURN_IF_ERROR(query.Bind(client).Step().status());
  return Counts{query.Integer(0), query.Integer(1), query.Integer(2), query.Integer(3)};
}

absl::Status JobQueue::Clean() {
  return database_->Execute(
      "DELETE FROM clients WHERE NOT EXISTS(SELECT 1 FROM queue WHERE queue.client ="
      " clients.client); DELETE FROM workers WHERE seen < now() - interval '1 hour'");
}

}  // namespace rilievo
