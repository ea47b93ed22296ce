// Rows that are damaged, out of the way of the others.
#include "core/base/status_macros.h"
#include "server/store/job_tables.h"

namespace rilievo {

absl::Status JobTables::SetAside(const std::vector<std::pair<int64_t, std::string>>& rows) {
  const auto move_rows = [&]() -> absl::Status {
    for (const auto& [number, id] : rows) {
      RILIEVO_ASSIGN_OR_RETURN(
          Query keep,
          database_.Prepare("INSERT OR REPLACE INTO damaged SELECT job_id, owner, scan, mesh,"
                            " surface, (SELECT value FROM state WHERE name = CAST('store_ms' AS"
                            " BLOB)), header, job FROM jobs WHERE number = ?"));
      RILIEVO_RETURN_IF_ERROR(keep.Bind(number).Run());
      RILIEVO_ASSIGN_OR_RETURN(Query drop, database_.Prepare("DELETE FROM jobs WHERE number = ?"));
      RILIEVO_RETURN_IF_ERROR(drop.Bind(number).Run());
    }
    return Recount();
  };
  RILIEVO_RETURN_IF_ERROR(database_.Transact(move_rows));
  for (const auto& [number, id] : rows) damaged_.push_back(id);
  return absl::OkStatus();
}

absl::Status JobTables::SetAside(const std::string& job_id) {
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           database_.Prepare("SELECT number FROM jobs WHERE job_id = ?"));
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(job_id).Step());
  if (!found) return absl::OkStatus();
  const int64_t number = query.Integer(0);
  RILIEVO_RETURN_IF_ERROR(query.Run());
  return SetAside({{number, job_id}});
}

absl::StatusOr<bool> JobTables::IsDamaged(const std::string& owner, const std::string& job_id) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_.Prepare("SELECT 1 FROM damaged WHERE owner = ? AND job_id = ?"));
  return query.Bind(owner).Bind(job_id).Step();
}

absl::Status JobTables::ForgetDamaged(const std::string& job_id) {
  RILIEVO_ASSIGN_OR_RETURN(Query query, database_.Prepare("DELETE FROM damaged WHERE job_id = ?"));
  RILIEVO_RETURN_IF_ERROR(query.Bind(job_id).Run());
  return Recount();
}

}  // namespace rilievo
