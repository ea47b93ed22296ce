// Bytes in PostgreSQL, in parts of at most 1 MiB: those of blobs, and of uploads on their way.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/blob_store.h"
#include "server/store/database.h"
#include "server/store/lease_pool.h"

namespace rilievo {

// Connections for bytes, apart from those for tables: who has one of these may need one of those.
using PostgresConnections = LeasePool<Database>;

// Rows of the table `parts`. What a name has lies without gaps from byte 0 on.
class PostgresParts {
 public:
  explicit PostgresParts(Database* database) : database_(database) {}

  absl::Status Append(const std::string& name, int64_t begin, const std::string& bytes);

  // One past the last byte; 0 when there are none.
  absl::StatusOr<int64_t> End(const std::string& name);

  // In order, until the end or an error of `take`. DATA_LOSS when parts are missing, as when they
  // are removed meanwhile.
  absl::Status Read(const std::string& name,
                    const std::function<absl::Status(const std::string& bytes)>& take);

  // The one that begins there; empty when there is none.
  absl::StatusOr<std::string> PartAt(const std::string& name, int64_t begin);

  // Within a transaction. Where `to` is there already, `from` goes: the bytes are the same.
  absl::Status Rename(const std::string& from, const std::string& to);

  // The same, and UNAVAILABLE unless `to` then has `bytes` in all: parts that were not on disk yet
  // go when the database ends uncleanly, and who wrote them does not hear of it.
  absl::Status Adopt(const std::string& from, const std::string& to, int64_t bytes);

  // Within a transaction: what lies beyond is dropped.
  absl::Status Truncate(const std::string& name, int64_t end);

  absl::Status Remove(const std::string& name);

 private:
  Database* const database_;
};

}  // namespace rilievo
