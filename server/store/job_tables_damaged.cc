// Rows that are damaged, out of the way of the others.
#include "core/base/status_macros.h"
#include "server/store/job_queue.h"
#include "server/store/job_tables.h"

namespace rilievo {

absl::Status JobTables::SetAside(const std::vector<std::pair<int64_t, std::string>>& rows) {
  const auto move_rows = [&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(const int64_t now_ms, State("store_ms"));
    for (const auto& [number, id] : rows) {
      RILIEVO_ASSIGN_OR_RETURN(Query older,
                               database_->Prepare("DELETE FROM damaged WHERE job_id = $1"));
      RILIEVO_RETURN_IF_ERROR(older.Bind(id).Run());
      RILIEVO_ASSIGN_OR_RETURN(
          Query keep, database_->Prepare("INSERT INTO damaged SELECT job_id, owner, scan, mesh,"
                                         " surface, $1, header, job FROM jobs WHERE number = $2"));
      RILIEVO_RETURN_IF_ERROR(keep.Bind(now_ms).Bind(number).Run());
      RILIEVO_ASSIGN_OR_RETURN(Query drop,
                               database_->Prepare("DELETE FROM jobs WHERE number = $1"));
      RILIEVO_RETURN_IF_ERROR(drop.Bind(number).Run());
      if (database_->shared()) RILIEVO_RETURN_IF_ERROR(JobQueue(database_.get()).Remove(id));
    }
    return Recount();
  };
  RILIEVO_RETURN_IF_ERROR(database_->Transact(move_rows));
  for (const auto& [number, id] : rows) damaged_.push_back(id);
  return absl::OkStatus();
}

absl::Status JobTables::SetAside(const std::string& job_id) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_->Prepare("SELECT number FROM jobs WHERE job_id = $1"));
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(job_id).Step());
  if (!found) return absl::OkStatus();
  const int64_t number = query.Integer(0);
  RILIEVO_RETURN_IF_ERROR(query.Run());
  return SetAside({{number, job_id}});
}

absl::StatusOr<bool> JobTables::IsDamaged(const std::string& owner, const std::string& job_id) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_->Prepare("SELECT 1 FROM damaged WHERE owner = $1 AND job_id = $2"));
  return query.Bind(owner).Bind(job_id).Step();
}

absl::Status JobTables::ForgetDamaged(const std::string& job_id) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_->Prepare("DELETE FROM damaged WHERE job_id = $1"));
  RILIEVO_RETURN_IF_ERROR(query.Bind(job_id).Run());
  return Recount();
}

}  // namespace rilievo
