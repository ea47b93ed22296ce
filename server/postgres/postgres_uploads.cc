#include "server/postgres/postgres_uploads.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/store/content_name.h"

namespace rilievo {
namespace {

constexpr char kBusy[] = "now() + interval '60 seconds'";

std::string PartsOf(const std::string& upload) { return absl::StrCat("upload:", upload); }

struct Turn {
  std::string upload;
  int64_t number = 0;
};

// An upload that is whole, in the database that has the blobs too.
class WholeParts final : public StagedBlob {
 public:
  WholeParts(PostgresConnections* connections, Turn turn, const std::string& name, int64_t bytes)
      : StagedBlob(name, bytes), connections_(connections), turn_(std::move(turn)) {}

  // Unless a later writer has begun to change them.
  absl::Status Adopt(Database* tables) const override {
    if (tables == nullptr) {
      const auto connection = connections_->Take();
      return connection->TransactBesideOthers([&] { return Adopt(connection.get()); });
    }
    RILIEVO_ASSIGN_OR_RETURN(
        Query end, tables->Prepare("DELETE FROM upload_turns WHERE name = $1 AND turn = $2"));
    RILIEVO_RETURN_IF_ERROR(end.Bind(turn_.upload).Bind(turn_.number).Run());
    if (tables->Changes() != 1) return UploadTakenOver();
    return PostgresParts(tables).Adopt(PartsOf(turn_.upload), name(), bytes());
  }

 private:
  PostgresConnections* const connections_;
  const Turn turn_;
};

class PostgresUploadWriter final : public UploadWriter {
 public:
  PostgresUploadWriter(std::shared_ptr<PostgresConnections> connections, const BlobStore* blobs,
                       Turn turn, int64_t size)
      : connections_(std::move(connections)), blobs_(blobs), turn_(std::move(turn)), size_(size) {
    if (size == 0) hash_.emplace();
  }
  ~PostgresUploadWriter() override { Leave().IgnoreError(); }

  absl::Status Append(const std::string& bytes) override;
  int64_t size() const override { return size_; }
  absl::Status Finish(int64_t total_bytes, const std::string& sha256, const Take& take) override;

 private:
  absl::Status Leave();
  absl::Status Drop();
  // The one that begins there, empty at the end. The turn goes on for as long as parts are read.
  absl::StatusOr<std::string> PartAt(int64_t begin) const;
  // Of all that is stored.
  absl::StatusOr<Sha256> StoredHash() const;
  // To where blobs are, from the database.
  absl::StatusOr<std::unique_ptr<StagedBlob>> ToBlobs() const;

  const std::shared_ptr<PostgresConnections> connections_;
  const BlobStore* const blobs_;  // null where blobs are parts too
  const Turn turn_;
  int64_t size_;
  std::optional<Sha256> hash_;  // of all bytes while they came in one go
};

// One statement: the turn is looked at and the bytes are written, or neither. Bytes that were not
// on disk yet when the database ended uncleanly leave a gap, which is not written beyond.
absl::Status PostgresUploadWriter::Append(const std::string& bytes) {
  const auto connection = connections_->Take();
  RILIEVO_ASSIGN_OR_RETURN(
      Query query,
      connection->Prepare(absl::StrCat(
          "WITH mine AS (UPDATE upload_turns SET busy_until = ", kBusy,
          " WHERE name = $1 AND turn = $2 RETURNING 1) INSERT INTO parts(name, begins, bytes)"
          " SELECT $3, $4, $5 FROM mine WHERE $4 = coalesce((SELECT begins + octet_length(bytes)"
          " FROM parts WHERE name = $3 ORDER BY begins DESC LIMIT 1), 0)")));
  query.Bind(turn_.upload).Bind(turn_.number).Bind(PartsOf(turn_.upload)).Bind(size_).Bind(bytes);
  const absl::Status written = connection->TransactUnflushed([&]() -> absl::Status {
    const absl::Status sent = query.Run();
    return sent.ok() && connection->Changes() != 1 ? UploadTakenOver() : sent;
  });
  RILIEVO_RETURN_IF_ERROR(written);
  if (hash_) AddBytes(bytes.data(), bytes.size(), &*hash_);
  size_ += static_cast<int64_t>(bytes.size());
  return absl::OkStatus();
}

absl::Status PostgresUploadWriter::Leave() {
  const auto connection = connections_->Take();
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, connection->Prepare("UPDATE upload_turns SET busy_until = now() WHERE name = $1"
                                       " AND turn = $2"));
  return query.Bind(turn_.upload).Bind(turn_.number).Run();
}

absl::Status PostgresUploadWriter::Drop() {
  const auto connection = connections_->Take();
  return connection->TransactBesideOthers([&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(
        Query end, connection->Prepare("DELETE FROM upload_turns WHERE name = $1 AND turn = $2"));
    RILIEVO_RETURN_IF_ERROR(end.Bind(turn_.upload).Bind(turn_.number).Run());
    if (connection->Changes() != 1) return UploadTakenOver();
    return PostgresParts(connection.get()).Remove(PartsOf(turn_.upload));
  });
}

absl::StatusOr<std::string> PostgresUploadWriter::PartAt(int64_t begin) const {
  Move();
  const auto connection = connections_->Take();
  std::string part;
  const absl::Status read = connection->TransactUnflushed([&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(Query renewal, connection->Prepare(absl::StrCat(
                                                "UPDATE upload_turns SET busy_until = ", kBusy,
                                                " WHERE name = $1 AND turn = $2")));
    RILIEVO_RETURN_IF_ERROR(renewal.Bind(turn_.upload).Bind(turn_.number).Run());
    if (connection->Changes() != 1) return UploadTakenOver();
    RILIEVO_ASSIGN_OR_RETURN(part,
                             PostgresParts(connection.get()).PartAt(PartsOf(turn_.upload), begin));
    return absl::OkStatus();
  });
  if (!read.ok()) return read;
  return part;
}

absl::StatusOr<Sha256> PostgresUploadWriter::StoredHash() const {
  Sha256 hash;
  for (int64_t at = 0; at < size_;) {
    RILIEVO_ASSIGN_OR_RETURN(const std::string part, PartAt(at));
    if (part.empty()) return absl::DataLossError("parts of what was sent are missing");
    AddBytes(part.data(), part.size(), &hash);
    at += static_cast<int64_t>(part.size());
  }
  return hash;
}

absl::StatusOr<std::unique_ptr<StagedBlob>> PostgresUploadWriter::ToBlobs() const {
  std::string part;
  int64_t at = 0;
  return blobs_->StageFrom([&]() -> absl::StatusOr<std::string_view> {
    RILIEVO_ASSIGN_OR_RETURN(part, PartAt(at));
    at += static_cast<int64_t>(part.size());
    return std::string_view(part);
  });
}

absl::Status PostgresUploadWriter::Finish(int64_t total_bytes, const std::string& sha256,
                                          const Take& take) {
  if (size_ == total_bytes && !hash_) {
    RILIEVO_ASSIGN_OR_RETURN(hash_, StoredHash());
  }
  const std::string stored = hash_ ? ContentName(*hash_) : "";
  if (size_ != total_bytes || stored != sha256) {
    RILIEVO_RETURN_IF_ERROR(Drop());
    return UploadMismatch(total_bytes, sha256, size_, stored);
  }
  if (blobs_ == nullptr) return take(WholeParts(connections_.get(), turn_, sha256, size_));
  RILIEVO_ASSIGN_OR_RETURN(const auto moved, ToBlobs());
  if (moved->name() != sha256) return UploadTakenOver();  // a later writer has changed them
  RILIEVO_RETURN_IF_ERROR(take(*moved));
  Drop().IgnoreError();
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::unique_ptr<UploadWriter>> PostgresUploads::Continue(const std::string& name,
                                                                        int64_t offset) {
  Turn turn{name, 0};
  int64_t stored = 0;
  // From here on no earlier writer writes.
  const auto begin = [&](Database* database) -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(
        Query query, database->Prepare(absl::StrCat(
                         "INSERT INTO upload_turns VALUES($1, nextval('turns'), ", kBusy,
                         ") ON CONFLICT(name) DO UPDATE SET turn = excluded.turn, busy_until ="
                         " excluded.busy_until RETURNING turn")));
    RILIEVO_RETURN_IF_ERROR(query.Bind(name).Step().status());
    turn.number = query.Integer(0);
    PostgresParts parts(database);
    RILIEVO_ASSIGN_OR_RETURN(stored, parts.End(PartsOf(name)));
    return offset < stored ? parts.Truncate(PartsOf(name), offset) : absl::OkStatus();
  };
  {
    const auto connection = connections_->Take();
    RILIEVO_RETURN_IF_ERROR(
        connection->TransactBesideOthers([&] { return begin(connection.get()); }));
  }
  // Its destructor gives the turn back, also where it is not returned.
  auto writer = std::make_unique<PostgresUploadWriter>(connections_, in_parts_ ? nullptr : blobs_,
                                                       turn, std::min(offset, stored));
  if (offset > stored) return OffsetBeyondStored(offset, stored);
  return writer;
}

absl::StatusOr<int64_t> PostgresUploads::StoredBytes(const std::string& name) {
  return PostgresParts(connections_->Take().get()).End(PartsOf(name));
}

absl::StatusOr<bool> PostgresUploads::RemoveIfIdle(const std::string& name) {
  const auto connection = connections_->Take();
  bool idle = true;
  const absl::Status removed = connection->TransactBesideOthers([&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(Query query,
                             connection->Prepare("SELECT CAST(busy_until <= now() AS INTEGER) FROM"
                                                 " upload_turns WHERE name = $1 FOR UPDATE"));
    RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(name).Step());
    idle = !found || query.Integer(0) != 0;
    if (!idle) return absl::OkStatus();
    RILIEVO_ASSIGN_OR_RETURN(Query end,
                             connection->Prepare("DELETE FROM upload_turns WHERE name = $1"));
    RILIEVO_RETURN_IF_ERROR(end.Bind(name).Run());
    return PostgresParts(connection.get()).Remove(PartsOf(name));
  });
  RILIEVO_RETURN_IF_ERROR(removed);
  return idle;
}

absl::StatusOr<std::vector<FileEntry>> PostgresUploads::List() const {
  const auto connection = connections_->Take();
  RILIEVO_ASSIGN_OR_RETURN(
      Query query,
      connection->Prepare("SELECT upload_turns.name, CAST(COALESCE(SUM(octet_length(bytes)), 0) AS"
                          " BIGINT) FROM upload_turns LEFT JOIN parts ON parts.name ="
                          " CAST('upload:' AS BYTEA) || upload_turns.name"
                          " GROUP BY upload_turns.name ORDER BY upload_turns.name"));
  std::vector<FileEntry> entries;
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) return entries;
    entries.push_back({.name = query.Bytes(0), .bytes = query.Integer(1)});
  }
}

}  // namespace rilievo
