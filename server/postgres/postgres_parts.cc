#include "server/postgres/postgres_parts.h"

#include "core/base/status_macros.h"

namespace rilievo {

absl::Status PostgresParts::Append(const std::string& name, int64_t begin,
                                   const std::string& bytes) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_->Prepare("INSERT INTO parts(name, begins, bytes) VALUES($1, $2, $3)"));
  return query.Bind(name).Bind(begin).Bind(bytes).Post();
}

absl::StatusOr<int64_t> PostgresParts::End(const std::string& name) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_->Prepare("SELECT begins + octet_length(bytes) FROM parts WHERE name ="
                                      " $1 ORDER BY begins DESC LIMIT 1"));
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(name).Step());
  return found ? query.Integer(0) : 0;
}

absl::Status PostgresParts::Read(
    const std::string& name, const std::function<absl::Status(const std::string& bytes)>& take) {
  RILIEVO_ASSIGN_OR_RETURN(const int64_t end, End(name));
  for (int64_t at = 0; at < end;) {
    RILIEVO_ASSIGN_OR_RETURN(const std::string bytes, PartAt(name, at));
    if (bytes.empty()) return absl::DataLossError("parts of what is stored are missing");
    RILIEVO_RETURN_IF_ERROR(take(bytes));
    at += static_cast<int64_t>(bytes.size());
  }
  return absl::OkStatus();
}

absl::StatusOr<std::string> PostgresParts::PartAt(const std::string& name, int64_t begin) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_->Prepare("SELECT bytes FROM parts WHERE name = $1 AND begins = $2"));
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(name).Bind(begin).Step());
  return found ? query.Bytes(0) : "";
}

absl::Status PostgresParts::Rename(const std::string& from, const std::string& to) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query query,
      database_->Prepare("UPDATE parts SET name = $2, since = now() WHERE name = $1 AND"
                         " NOT EXISTS(SELECT 1 FROM parts WHERE name = $2)"));
  RILIEVO_RETURN_IF_ERROR(query.Bind(from).Bind(to).Post());
  return Remove(from);
}

absl::Status PostgresParts::Adopt(const std::string& from, const std::string& to, int64_t bytes) {
  RILIEVO_RETURN_IF_ERROR(Rename(from, to));
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, database_->Prepare("SELECT CAST(coalesce(sum(octet_length(bytes)), 0) AS BIGINT)"
                                      " FROM parts WHERE name = $1"));
  RILIEVO_RETURN_IF_ERROR(query.Bind(to).Step().status());
  if (query.Integer(0) == bytes) return absl::OkStatus();
  return absl::UnavailableError("the database lost parts of what was written; send it again");
}

absl::Status PostgresParts::Truncate(const std::string& name, int64_t end) {
  RILIEVO_ASSIGN_OR_RETURN(
      Query beyond, database_->Prepare("DELETE FROM parts WHERE name = $1 AND begins >= $2"));
  RILIEVO_RETURN_IF_ERROR(beyond.Bind(name).Bind(end).Run());
  RILIEVO_ASSIGN_OR_RETURN(
      Query last,
      database_->Prepare("UPDATE parts SET bytes = substring(bytes FROM 1 FOR CAST($2 - begins AS"
                         " INTEGER)) WHERE name = $1 AND begins + octet_length(bytes) > $2"));
  return last.Bind(name).Bind(end).Run();
}

absl::Status PostgresParts::Remove(const std::string& name) {
  RILIEVO_ASSIGN_OR_RETURN(Query query, database_->Prepare("DELETE FROM parts WHERE name = $1"));
  return query.Bind(name).Post();
}

}  // namespace rilievo
