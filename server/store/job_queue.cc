#include "server/store/job_queue.h"

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

// Workers renew each second; a stall of the network or of the database costs no work.
constexpr char kLease[] = "interval '15 seconds'";

}  // namespace

absl::Status JobQueue::Insert(const std::string& job_id, const std::string& client,
                              int64_t memory) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query,
      database_->Prepare("INSERT INTO queue(job_id, client, memory) VALUES($1, $2, $3)"));
  RILIEVO_RETURN_IF_ERROR(query.Bind(job_id).Bind(client).Bind(memory).Run());
  // Behind those who are waiting.
  RILIEVO_ASSIGN_OR_RETURN(Query turn,
                           database_->Prepare("INSERT INTO clients VALUES($1, nextval('turns'))"
                                              " ON CONFLICT(client) DO NOTHING"));
  return turn.Bind(client).Run();
}

absl::Status JobQueue::Remove(const std::string& job_id) {
  RILIEVO_ASSIGN_OR_RETURN(Query query, database_->Prepare("DELETE FROM queue WHERE job_id = $1"));
  return query.Bind(job_id).Run();
}

absl::StatusOr<std::optional<JobClaim>> JobQueue::Claim(const ClaimDemand& demand) {
  // The first few of each client: others may be at the very first ones just now.
  static const std::string next_in_turn = absl::StrCat(
      R"(SELECT waiting.number FROM queue AS waiting JOIN (
          SELECT ahead.number, clients.last_turn FROM clients CROSS JOIN LATERAL (
            SELECT number FROM queue
            WHERE queue.client = clients.client AND worker = '' AND suspect = 0
              AND (memory <= $2 OR $3 = 1 AND $2 >= (SELECT MAX(memory) FROM workers
                   WHERE seen > now() - )",
      kLease, R"())
            ORDER BY number LIMIT 8) AS ahead) AS heads ON heads.number = waiting.number
        WHERE waiting.worker = '' ORDER BY heads.last_turn, waiting.number
        LIMIT 1 FOR UPDATE OF waiting SKIP LOCKED)");
  static const std::string suspect =
      "SELECT number FROM queue WHERE worker = '' AND suspect = 1 AND $2 >= 0 AND $3 = 1"
      " ORDER BY number LIMIT 1 FOR UPDATE SKIP LOCKED";
  std::optional<JobClaim> taken;
  RILIEVO_RETURN_IF_ERROR(database_->TransactBesideOthers([&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(taken, Take(next_in_turn, demand));
    if (taken || !demand.idle) return absl::OkStatus();
    RILIEVO_ASSIGN_OR_RETURN(taken, Take(suspect, demand));
    return absl::OkStatus();
  }));
  return taken;
}

absl::StatusOr<std::optional<JobClaim>> JobQueue::Take(const std::string& number,
                                                       const ClaimDemand& demand) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_->Prepare(absl::StrCat(
                       "UPDATE queue SET worker = $1, claim = claim + 1, event = '',"
                       " lease_until = now() + ",
                       kLease, " WHERE number = (", number, ") RETURNING job_id, claim, client")));
  query.Bind(demand.worker).Bind(demand.memory).Bind(int64_t{demand.idle});
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Step());
  if (!found) return std::nullopt;
  RILIEVO_ASSIGN_OR_RETURN(Query turn,
                           database_->Prepare("INSERT INTO clients VALUES($1, nextval('turns')) ON"
                                              " CONFLICT(client) DO UPDATE SET last_turn ="
                                              " excluded.last_turn"));
  RILIEVO_RETURN_IF_ERROR(turn.Bind(query.Bytes(2)).Run());
  return JobClaim{query.Bytes(0), query.Integer(1)};
}

absl::StatusOr<bool> JobQueue::Holds(const JobClaim& claim) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query,
      database_->Prepare("SELECT 1 FROM queue WHERE job_id = $1 AND claim = $2 AND worker <> ''"
                         " FOR UPDATE"));
  return query.Bind(claim.job_id).Bind(claim.number).Step();
}

absl::Status JobQueue::Lock(const std::string& job_id) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_->Prepare("SELECT 1 FROM queue WHERE job_id = $1 FOR UPDATE"));
  return query.Bind(job_id).Run();
}

absl::Status JobQueue::Release(const JobClaim& claim, bool suspect) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_->Prepare("UPDATE queue SET worker = '', lease_until = NULL, event ="
                                      " '', suspect = $3 WHERE job_id = $1 AND claim = $2"));
  return query.Bind(claim.job_id).Bind(claim.number).Bind(int64_t{suspect}).Run();
}

absl::StatusOr<std::vector<JobClaim>> JobQueue::Renew(const ClaimDemand& worker) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query seen, database_->Prepare("INSERT INTO workers VALUES($1, $2, now()) ON CONFLICT(worker)"
                                     " DO UPDATE SET memory = excluded.memory, seen = now()"
                                     " WHERE workers.seen < now() - interval '5 seconds'"));
  RILIEVO_RETURN_IF_ERROR(seen.Bind(worker.worker).Bind(worker.memory).Run());
  RILIEVO_ASSIGN_OR_RETURN(Query query, database_->Prepare(absl::StrCat(
                                            "UPDATE queue SET lease_until = now() + ", kLease,
                                            " WHERE worker = $1"
                                            " RETURNING job_id, claim")));
  query.Bind(worker.worker);
  std::vector<JobClaim> claims;
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) break;
    claims.push_back({query.Bytes(0), query.Integer(1)});
  }
  RILIEVO_RETURN_IF_ERROR(FreeLost());
  return claims;
}

// In the order of their numbers, as whoever renews several leases locks them.
absl::Status JobQueue::FreeLost() {
  return database_->Execute(absl::StrCat(
      "UPDATE queue SET worker = '', lease_until = NULL, event = '' WHERE number IN (SELECT number"
      " FROM queue WHERE worker <> '' AND lease_until < now() AND pg_postmaster_start_time() <"
      " now() - ",
      kLease, " ORDER BY number FOR UPDATE SKIP LOCKED)"));
}

absl::Status JobQueue::Tell(const JobClaim& claim, const std::string& event) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query,
      database_->Prepare("UPDATE queue SET event = $3 WHERE job_id = $1 AND claim = $2"));
  return query.Bind(claim.job_id).Bind(claim.number).Bind(event).Run();
}

absl::StatusOr<std::string> JobQueue::LatestEvent(const std::string& job_id) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_->Prepare("SELECT event FROM queue WHERE job_id = $1"));
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(job_id).Step());
  return found ? query.Bytes(0) : "";
}

absl::StatusOr<JobQueue::Counts> JobQueue::Count(const std::string& client) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_->Prepare("SELECT COUNT(*), COUNT(*) FILTER (WHERE client = $1),"
                                      " COUNT(*) FILTER (WHERE worker = '') FROM queue"));
  RILIEVO_RETURN_IF_ERROR(query.Bind(client).Step().status());
  return Counts{query.Integer(0), query.Integer(1), query.Integer(2)};
}

absl::Status JobQueue::Clean() {
  return database_->Execute(
      "DELETE FROM clients WHERE NOT EXISTS(SELECT 1 FROM queue WHERE queue.client ="
      " clients.client); DELETE FROM workers WHERE seen < now() - interval '1 hour'");
}

}  // namespace rilievo
