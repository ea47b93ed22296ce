#include "server/store/database.h"

#include "core/base/status_macros.h"

namespace rilievo {

absl::StatusOr<int64_t> Database::Number(const std::string& sql) {
  RILIEVO_ASSIGN_OR_RETURN(Query query, Prepare(sql));
  RILIEVO_ASSIGN_OR_RETURN(const bool row, query.Step());
  return row ? query.Integer(0) : 0;
}

}  // namespace rilievo
