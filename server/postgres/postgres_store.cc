#include "server/postgres/postgres_store.h"

#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/postgres/postgres_blobs.h"
#include "server/postgres/postgres_database.h"
#include "server/postgres/postgres_schema.h"
#include "server/postgres/postgres_uploads.h"
#include "server/s3/s3_blobs.h"
#include "server/store/blob_folder.h"

namespace rilievo {
namespace {

// As many as threads wait for a store: two of short requests, two of bytes, jobs that begin or end.
constexpr int kConnections = 4;

constexpr char kFile[] = "file:", kPg[] = "pg:";

// file:/shared as well as file:///shared.
std::string FolderOf(const std::string& blobs) {
  const std::string path = blobs.substr(sizeof(kFile) - 1);
  return absl::StartsWith(path, "//") ? path.substr(2) : path;
}

absl::StatusOr<std::unique_ptr<BlobStore>> OpenBlobs(
    const std::string& blobs, const std::string& scratch,
    const std::shared_ptr<PostgresConnections>& connections) {
  if (IsS3Url(blobs)) {
    RILIEVO_ASSIGN_OR_RETURN(const S3Place place, ParseS3Url(blobs));
    return S3Blobs::Open(connections, place, scratch);
  }
  if (!absl::StartsWith(blobs, kFile)) return PostgresBlobs::Open(connections, scratch);
  RILIEVO_ASSIGN_OR_RETURN(BlobFolder folder,
                           BlobFolder::Open(FolderOf(blobs), BlobFolder::Users::kMany));
  return std::make_unique<BlobFolder>(std::move(folder));
}

// The database's wall clock, which all who share a store go by; from now on this machine counts.
absl::StatusOr<StoreClock::Source> ClockOf(Database* database) {
  RILIEVO_ASSIGN_OR_RETURN(
      const int64_t wall_ms,
      database->Number("SELECT CAST(EXTRACT(EPOCH FROM clock_timestamp()) * 1000 AS BIGINT)"));
  const auto steady_ms = StoreClock::System().steady_ms;
  return StoreClock::Source{
      [steady_ms, wall_ms, begin = steady_ms()] { return wall_ms + steady_ms() - begin; },
      steady_ms};
}

}  // namespace

absl::Status CheckBlobsUrl(const std::string& blobs) {
  if (blobs.empty() || blobs == kPg) return absl::OkStatus();
  if (IsS3Url(blobs)) return ParseS3Url(blobs).status();
  if (absl::StartsWith(blobs, kFile) && absl::StartsWith(FolderOf(blobs), "/")) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(absl::StrCat(
      "blobs: ", blobs, "; give pg:, file:FOLDER with the folder's whole path, or s3://BUCKET"));
}

absl::StatusOr<std::unique_ptr<JobStore>> OpenPostgresStore(const std::string& url,
                                                            const std::string& blobs,
                                                            StoreSettings settings) {
  RILIEVO_RETURN_IF_ERROR(CheckPostgresUrl(url));
  RILIEVO_RETURN_IF_ERROR(CheckBlobsUrl(blobs));
  StoreParts parts;
  parts.shared = true;
  PostgresDatabase first(url);
  RILIEVO_RETURN_IF_ERROR(MakePostgresTables(&first));
  if (settings.clock) {
    parts.clock = *settings.clock;
  } else {
    RILIEVO_ASSIGN_OR_RETURN(parts.clock, ClockOf(&first));
  }
  std::vector<std::unique_ptr<JobTables>> tables;
  std::vector<std::unique_ptr<Database>> of_bytes;
  for (int i = 0; i < kConnections; ++i) {
    tables.push_back(std::make_unique<JobTables>(std::make_unique<PostgresDatabase>(url)));
    of_bytes.push_back(std::make_unique<PostgresDatabase>(url));
  }
  parts.tables = std::make_unique<LeasePool<JobTables>>(std::move(tables));
  const auto connections = std::make_shared<PostgresConnections>(std::move(of_bytes));
  const bool in_parts = blobs.empty() || blobs == kPg;
  RILIEVO_ASSIGN_OR_RETURN(parts.blobs, OpenBlobs(blobs, settings.scratch, connections));
  parts.uploads = std::make_unique<PostgresUploads>(connections, parts.blobs.get(), in_parts);
  return JobStore::Open(std::move(parts), std::move(settings));
}

}  // namespace rilievo
