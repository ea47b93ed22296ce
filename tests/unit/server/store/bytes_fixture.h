// Blobs and uploads of the test, without tables: in a folder, in PostgreSQL, and uploads there with
// blobs in a folder or in S3.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "server/postgres/postgres_blobs.h"
#include "server/postgres/postgres_database.h"
#include "server/postgres/postgres_schema.h"
#include "server/postgres/postgres_uploads.h"
#include "server/s3/s3_blobs.h"
#include "server/store/blob_folder.h"
#include "server/store/partial_uploads.h"
#include "tests/unit/server/store/job_store_fixture.h"

namespace rilievo {

class BytesTest : public testing::TestWithParam<StorePlace> {
 protected:
  void SetUp() override {
    if (GetParam() != StorePlace::kFolder) {
      RILIEVO_TEST_POSTGRES(server);
      url_ = server->NewDatabase();
      PostgresDatabase database(url_);
      ASSERT_TRUE(MakePostgresTables(&database).ok());
    }
    if (GetParam() == StorePlace::kPostgresAndS3) {
      RILIEVO_TEST_S3(bucket);
      s3_url_ = bucket->NewUrl();
    }
    Reopen();
  }

  // As a server does that has started anew.
  void Reopen() {
    uploads_.reset();
    blobs_.reset();
    const BlobFolder folder = *BlobFolder::Open(test_ / "blobs");
    if (GetParam() == StorePlace::kFolder) {
      blobs_ = std::make_unique<BlobFolder>(folder);
      uploads_ = *PartialUploads::Open(test_ / "uploads", folder);
      return;
    }
    // One connection: who waits for a second one would wait for ever.
    std::vector<std::unique_ptr<Database>> one;
    one.push_back(std::make_unique<PostgresDatabase>(url_));
    const auto connections = std::make_shared<PostgresConnections>(std::move(one));
    const bool in_parts = GetParam() == StorePlace::kPostgres;
    if (in_parts) {
      blobs_ = *PostgresBlobs::Open(connections, testing::TempDir());
    } else if (!s3_url_.empty()) {
      blobs_ = *S3Blobs::Open(connections, *ParseS3Url(s3_url_));
    } else {
      blobs_ = std::make_unique<BlobFolder>(folder);
    }
    uploads_ = std::make_unique<PostgresUploads>(connections, blobs_.get(), in_parts);
  }

  TestFolder test_;
  std::string url_, s3_url_;
  std::unique_ptr<BlobStore> blobs_;
  std::unique_ptr<ScanUploads> uploads_;
};

inline std::string Contents(const FileDescriptor& file) {
  std::string bytes(static_cast<size_t>(*file.Size()), '\0');
  EXPECT_TRUE(file.ReadAt(0, bytes.data(), bytes.size()).ok());
  return bytes;
}

}  // namespace rilievo
