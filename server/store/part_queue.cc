#include "server/store/part_queue.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "core/base/status_macros.h"
#include "server/store/job_queue.h"

namespace rilievo {
namespace {

// Of a part, by those who help: it may be what ends them.
constexpr int kMostTries = 3;

// Parts that nobody has, and that are to be done, for the first time or once more.
constexpr char kOpen[] = "worker = '' AND (result = '' OR twice > 0)";

constexpr int kUncodedStep = static_cast<int>(PartStep::kUncoded);
constexpr int kCodedStep = static_cast<int>(PartStep::kCoded);
constexpr int kMeasuredStep = static_cast<int>(PartStep::kMeasured);

const std::string& IsForAll() {
  static const std::string sql = absl::StrCat("step NOT IN (", kUncodedStep, ", ", kCodedStep, ")");
  return sql;
}

// Parts of all steps that are not the leader's, those of measuring only where what was coded is
// there, and those of coding only where what is to be known before is.
const std::string& ToHelpWith() {
  static const std::string sql = absl::StrCat(
      "(", IsForAll(), " AND (step < ", kUncodedStep, " OR step > ", kMeasuredStep,
      " OR EXISTS(SELECT 1 FROM job_parts AS coded WHERE coded.job_id = job_parts.job_id AND"
      " coded.step = ",
      kCodedStep, " AND coded.result <> '')) AND (step < ", kUncodedStep,
      " OR NOT EXISTS(SELECT 1 FROM job_parts AS uncoded WHERE uncoded.job_id = job_parts.job_id "
      "AND"
      " uncoded.step = ",
      kUncodedStep, " AND uncoded.result = '')))");
  return sql;
}

constexpr char kHelps[] = "/help";

// The worker, whether it leads or helps.
std::string WhoIs(const std::string& worker) {
  return std::string(absl::StripSuffix(worker, kHelps));
}

// A part that this worker, of these two names, has done before. Its memory or its processor may be
// at fault, so that it would find the same again.
std::string IsByItself(const std::string& leads, const std::string& helps) {
  return absl::StrCat("(result <> '' AND (found_by IN (", leads, ", ", helps, ") OR other_by IN (",
                      leads, ", ", helps, ")))");
}

int64_t NumberOf(PartStep step) { return static_cast<int64_t>(step); }

// Where the parts begin of which each so many-th is done twice: not at the same one in all jobs.
int64_t FirstChecked(const std::string& job_id, int64_t checked_share) {
  uint32_t sum = 0;
  for (const char c : job_id) sum = 31 * sum + static_cast<unsigned char>(c);
  return sum % checked_share;
}

}  // namespace

std::string NameOfHelper(const std::string& worker) { return absl::StrCat(worker, kHelps); }

absl::StatusOr<bool> PartQueue::IsInForce(const PartWorker& worker) {
  // Neither finished nor taken by another leader before this transaction ends.
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_->Prepare("SELECT 1 FROM queue WHERE job_id = $1 AND ($2 = 0 OR claim ="
                                      " $2 AND worker = $3) FOR KEY SHARE"));
  query.Bind(worker.job_id).Bind(worker.claim).Bind(worker.worker);
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Step());
  RILIEVO_RETURN_IF_ERROR(query.Run());
  return found;
}

absl::StatusOr<int> PartQueue::Make(const PartWorker& worker, PartStep step, int count,
                                    int64_t checked_share, int* done) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query,
      database_->Prepare("SELECT COUNT(*), COUNT(*) FILTER (WHERE result <> '' AND"
                         " twice = 0), COUNT(*) FILTER (WHERE recipe <> $3) FROM job_parts WHERE"
                         " job_id = $1 AND step = $2"));
  RILIEVO_RETURN_IF_ERROR(
      query.Bind(worker.job_id).Bind(NumberOf(step)).Bind(worker.recipe).Step().status());
  const auto found = static_cast<int>(query.Integer(0));
  *done = static_cast<int>(query.Integer(1));
  const bool is_ours = query.Integer(2) == 0;
  RILIEVO_RETURN_IF_ERROR(query.Run());
  if (!is_ours) return absl::FailedPreconditionError("its parts are by another version");
  if (found > 0) return found;
  RILIEVO_RETURN_IF_ERROR(CheckRecipe(worker));
  RILIEVO_ASSIGN_OR_RETURN(
      Query insert,
      database_->Prepare(
          "INSERT INTO job_parts(job_id, step, part, owner, recipe, twice) SELECT"
          " $1, $2, part, $3, $7, CASE WHEN $4 > 1 AND part % $5 = $6 THEN 1 ELSE 0 END FROM"
          " generate_series(0, $4 - 1) AS part ON CONFLICT DO NOTHING"));
  insert.Bind(worker.job_id).Bind(NumberOf(step)).Bind(worker.owner).Bind(count);
  insert.Bind(checked_share).Bind(FirstChecked(worker.job_id, checked_share)).Bind(worker.recipe);
  RILIEVO_RETURN_IF_ERROR(insert.Run());
  return count;
}

// A worker of another version may lead since, and have dropped what is by the recipe of this one.
absl::Status PartQueue::CheckRecipe(const PartWorker& worker) {
  if (worker.claim != 0) return absl::OkStatus();
  RILIEVO_ASSIGN_OR_RETURN(
      Query query,
      database_->Prepare(
          "SELECT 1 FROM job_parts WHERE job_id = $1 AND step <= $2 AND recipe = $3 LIMIT 1"));
  query.Bind(worker.job_id).Bind(NumberOf(PartStep::kCoarse)).Bind(worker.recipe);
  RILIEVO_ASSIGN_OR_RETURN(const bool is_led, query.Step());
  return is_led ? query.Run() : absl::FailedPreconditionError("nobody leads by this version");
}

absl::StatusOr<PartQueue::Turn> PartQueue::Take(const PartWorker& worker, PartStep step, int count,
                                                int64_t checked_share) {
  static const std::string own = IsByItself("$5", "$6");
  // The leader compares its own results where nobody else does. Of two that differ a third worker
  // finds the right one, as long as there may be one: until nothing was done for the time of a
  // lease.
  static const std::string sql = absl::StrCat(
      "UPDATE job_parts SET worker = $3, claim = claim + 1, lease_until = now() + ", kLease,
      " WHERE job_id = $1 AND step = $2 AND part = (SELECT part FROM job_parts WHERE job_id = $1"
      " AND step = $2 AND ",
      kOpen, " AND CASE WHEN $4 = 0 THEN ", IsForAll(), " AND claim < ", kMostTries, " AND NOT ",
      own, " ELSE twice < 2 OR NOT ", own,
      " OR NOT EXISTS(SELECT 1 FROM job_parts AS latest WHERE latest.job_id = $1 AND latest.step ="
      " $2 AND latest.lease_until > now()) END ORDER BY result <> '', ",
      own, ", part LIMIT 1 FOR UPDATE SKIP LOCKED) RETURNING part, claim");
  const std::string who = WhoIs(worker.worker);
  Turn turn;
  const absl::Status taken = database_->TransactUnflushed([&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(const bool in_force, IsInForce(worker));
    if (!in_force) return absl::FailedPreconditionError("the job ended, or goes on elsewhere");
    RILIEVO_ASSIGN_OR_RETURN(const int found, Make(worker, step, count, checked_share, &turn.done));
    if (found != count) {
      return absl::InternalError(absl::StrCat("workers have cut step ", NumberOf(step), " into ",
                                              found, " and into ", count, " parts"));
    }
    RILIEVO_ASSIGN_OR_RETURN(Query query, database_->Prepare(sql));
    query.Bind(worker.job_id).Bind(NumberOf(step)).Bind(worker.worker).Bind(worker.claim);
    query.Bind(who).Bind(NameOfHelper(who));
    RILIEVO_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) {
      if (turn.done == count) {
        RILIEVO_ASSIGN_OR_RETURN(turn.was_wrong, WasWrong(worker, step));
        return absl::OkStatus();
      }
      if (worker.claim != 0) return absl::OkStatus();
      RILIEVO_ASSIGN_OR_RETURN(turn.job_waits, IsForLeader(step)
                                                   ? IsOfUseElsewhere(worker)
                                                   : JobWaits(worker, /*suspect=*/false));
      return CheckLed(worker);
    }
    turn.claim = {.job_id = worker.job_id,
                  .owner = worker.owner,
                  .step = step,
                  .part = static_cast<int>(query.Integer(0)),
                  .number = query.Integer(1),
                  .worker = worker.worker};
    return query.Run();
  });
  if (!taken.ok()) return taken;
  return turn;
}

absl::StatusOr<bool> PartQueue::JobWaits(const PartWorker& worker, bool suspect) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_->Prepare("SELECT 1 FROM queue WHERE worker = '' AND suspect <="
                                              " $2 AND memory <= $1 LIMIT 1"));
  RILIEVO_ASSIGN_OR_RETURN(const bool found,
                           query.Bind(worker.memory).Bind(int64_t{suspect}).Step());
  RILIEVO_RETURN_IF_ERROR(query.Run());
  return found;
}

// One that waits for what the leader does alone, which may take long.
absl::StatusOr<bool> PartQueue::IsOfUseElsewhere(const PartWorker& worker) {
  RILIEVO_ASSIGN_OR_RETURN(const bool waits, JobWaits(worker, /*suspect=*/true));
  if (waits) return true;
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<std::string> jobs,
                           JobsToHelp(WhoIs(worker.worker), worker.memory, worker.recipe));
  return !jobs.empty();
}

absl::StatusOr<bool> PartQueue::WasWrong(const PartWorker& worker, PartStep step) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query,
      database_->Prepare("UPDATE job_parts SET other_by = '' WHERE job_id = $1 AND step"
                         " = $2 AND other_by = $3"));
  RILIEVO_RETURN_IF_ERROR(query.Bind(worker.job_id).Bind(NumberOf(step)).Bind(worker.worker).Run());
  return database_->Changes() > 0;
}

absl::Status PartQueue::CheckLed(const PartWorker& worker) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_->Prepare("SELECT 1 FROM queue WHERE job_id = $1 AND worker <> ''"));
  RILIEVO_ASSIGN_OR_RETURN(const bool led, query.Bind(worker.job_id).Step());
  return led ? query.Run() : absl::FailedPreconditionError("the job waits for a leader");
}

absl::StatusOr<PartQueue::Finished> PartQueue::Finish(const PartClaim& claim,
                                                      const std::string& result) {
  std::string known, found_by, other, other_by;
  int64_t twice = 0;
  {
    RILIEVO_ASSIGN_OR_RETURN(
        Query query,
        database_->Prepare("SELECT result, found_by, other, other_by, twice FROM job_parts WHERE"
                           " job_id = $1 AND step = $2 AND part = $3 AND claim = $4 AND worker = $5"
                           " FOR UPDATE"));
    query.Bind(claim.job_id).Bind(NumberOf(claim.step)).Bind(claim.part).Bind(claim.number);
    RILIEVO_ASSIGN_OR_RETURN(const bool in_force, query.Bind(claim.worker).Step());
    if (!in_force) return Finished{Kept::kOthers};
    known = query.Bytes(0);
    found_by = query.Bytes(1);
    other = query.Bytes(2);
    other_by = query.Bytes(3);
    twice = query.Integer(4);
    RILIEVO_RETURN_IF_ERROR(query.Run());
  }
  Finished finished;
  const std::string& agrees = known == result ? found_by : other_by;
  if (known.empty()) {
    known = result;
    found_by = claim.worker;
    if (twice == 2) {  // what it differed from is lost
      other.clear();
      other_by.clear();
      twice = 1;
    }
  } else if (twice == 2 && (known == result || other == result) &&
             WhoIs(agrees) == WhoIs(claim.worker)) {
    return absl::InternalError(
        absl::StrCat("part ", claim.part, " of step ", NumberOf(claim.step), " is ", known, " as ",
                     found_by, " has done it, and ", other, " as ", other_by,
                     " has; no third worker is there to tell who"
                     " is right: the memory or the processor of one of them is at fault"));
  } else if (known == result) {
    finished = {Kept::kSame, other_by};
    twice = 0;
  } else if (other.empty()) {
    finished.kept = Kept::kDoubtful;
    other = result;
    other_by = claim.worker;
    twice = 2;
  } else if (other == result) {
    finished = {Kept::kCorrected, found_by, known};
    known = result;
    other_by = std::exchange(found_by, claim.worker);
    twice = 0;
  } else {
    return absl::InternalError(absl::StrCat(
        "part ", claim.part, " of step ", NumberOf(claim.step), " is ", known, " as ", found_by,
        " has done it, ", other, " as ", other_by, " has, and ", result, " as ", claim.worker,
        " has: the memory or the processor of two of them is at fault"));
  }
  static const std::string sql = absl::StrCat(
      "UPDATE job_parts SET worker = '', lease_until = now() + ", kLease,
      ", result = $4, found_by = $5, other = $6, other_by = $7, twice = $8 WHERE job_id"
      " = $1 AND step = $2 AND part = $3");
  RILIEVO_ASSIGN_OR_RETURN(Query query, database_->Prepare(sql));
  query.Bind(claim.job_id).Bind(NumberOf(claim.step)).Bind(claim.part);
  query.Bind(known).Bind(found_by).Bind(other).Bind(other_by).Bind(twice);
  RILIEVO_RETURN_IF_ERROR(query.Run());
  return finished;
}

absl::StatusOr<std::string> PartQueue::Result(const std::string& job_id, PartStep step, int part) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_->Prepare("SELECT result FROM job_parts WHERE job_id = $1 AND step = $2"
                                      " AND part = $3"));
  RILIEVO_ASSIGN_OR_RETURN(const bool found,
                           query.Bind(job_id).Bind(NumberOf(step)).Bind(part).Step());
  return found ? query.Bytes(0) : "";
}

absl::StatusOr<bool> PartQueue::Reopen(const std::string& job_id, PartStep step, int part,
                                       const std::string& result) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_->Prepare("UPDATE job_parts SET result = '' WHERE job_id = $1 AND step"
                                      " = $2 AND part = $3 AND result = $4 AND result <> ''"));
  RILIEVO_RETURN_IF_ERROR(query.Bind(job_id).Bind(NumberOf(step)).Bind(part).Bind(result).Run());
  return database_->Changes() == 1;
}

absl::Status PartQueue::Release(const std::string& job_id, const std::string& worker) {
  return database_->TransactUnflushed([&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(
        Query query, database_->Prepare("UPDATE job_parts SET worker = '', lease_until = NULL"
                                        " WHERE job_id = $1 AND worker = $2"));
    return query.Bind(job_id).Bind(worker).Post();
  });
}

absl::Status PartQueue::Renew(const std::vector<PartClaim>& held) {
  static const std::string renew =
      absl::StrCat("UPDATE job_parts SET lease_until = now() + ", kLease,
                   " WHERE job_id = $1 AND step = $2 AND part = $3 AND claim = $4 AND worker = $5");
  static const std::string free = absl::StrCat(
      "UPDATE job_parts SET worker = '', lease_until = NULL WHERE (job_id, step, part) IN (SELECT"
      " job_id, step, part FROM job_parts WHERE worker <> '' AND lease_until < now() AND"
      " pg_postmaster_start_time() < now() - ",
      kLease, " FOR UPDATE SKIP LOCKED)");
  return database_->TransactUnflushed([&]() -> absl::Status {
    for (const PartClaim& claim : held) {
      RILIEVO_ASSIGN_OR_RETURN(Query query, database_->Prepare(renew));
      query.Bind(claim.job_id).Bind(NumberOf(claim.step)).Bind(claim.part).Bind(claim.number);
      RILIEVO_RETURN_IF_ERROR(query.Bind(claim.worker).Post());
    }
    RILIEVO_ASSIGN_OR_RETURN(Query lost, database_->Prepare(free));
    return lost.Post();
  });
}

absl::StatusOr<std::vector<std::string>> PartQueue::JobsToHelp(const std::string& worker,
                                                               int64_t memory,
                                                               const std::string& recipe) {
  static const std::string sql = absl::StrCat(
      "SELECT job_id FROM queue WHERE worker <> '' AND worker <> $1 AND memory <= $2 AND"
      " EXISTS(SELECT 1 FROM job_parts WHERE job_parts.job_id = queue.job_id AND recipe = $3 AND"
      " job_parts.claim < ",
      kMostTries, " AND ", ToHelpWith(), " AND NOT ", IsByItself("$1", "$4"), " AND job_parts.",
      kOpen, ") ORDER BY number LIMIT 16");
  RILIEVO_ASSIGN_OR_RETURN(Query query, database_->Prepare(sql));
  query.Bind(worker).Bind(memory).Bind(recipe).Bind(NameOfHelper(worker));
  std::vector<std::string> jobs;
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) return jobs;
    jobs.push_back(query.Bytes(0));
  }
}

absl::StatusOr<bool> PartQueue::Waits(const std::string& job_id) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_->Prepare("SELECT 1 FROM queue WHERE job_id = $1"));
  return query.Bind(job_id).Step();
}

}  // namespace rilievo
