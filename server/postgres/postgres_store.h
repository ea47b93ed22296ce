// A store that many servers and workers share, in PostgreSQL.
#pragma once

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/job_store.h"

namespace rilievo {

// INVALID_ARGUMENT unless `blobs` is "pg:", "file:FOLDER", "s3://BUCKET..." or empty.
absl::Status CheckBlobsUrl(const std::string& blobs);

// `url`: see CheckPostgresUrl(). `blobs`: where scans, surfaces and control meshes are, "pg:" (in
// the same database; the default), "file:FOLDER", a folder that all servers and workers have, or
// objects of a bucket (ParseS3Url()).
// Makes or brings up to date what is there. UNAVAILABLE when the database cannot be reached.
absl::StatusOr<std::unique_ptr<JobStore>> OpenPostgresStore(const std::string& url,
                                                            const std::string& blobs,
                                                            StoreSettings settings);

}  // namespace rilievo
