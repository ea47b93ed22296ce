#include "server/store/job_record.h"

#include <array>

#include "core/base/sha256.h"
#include "server/store/content_name.h"

namespace rilievo {
namespace {

void AddField(const std::string& field, Sha256* hash) {
  const uint64_t size = field.size();
  AddBytes(&size, sizeof(size), hash);
  AddBytes(field.data(), field.size(), hash);
}

int64_t Checksum(const StoredJob& stored, const JobRow& row) {
  Sha256 hash;
  for (const std::string* field :
       {&stored.owner, &stored.client, &stored.surface, &stored.mesh, &row.header, &row.job}) {
    AddField(*field, &hash);
  }
  const int64_t numbers[] = {stored.unclean_ends, row.end_ms};
  AddBytes(numbers, sizeof(numbers), &hash);
  int64_t checksum = 0;
  for (const uint8_t byte : hash.Finish()) {
    checksum = static_cast<int64_t>(static_cast<uint64_t>(checksum) * 257 + byte);
  }
  return checksum;
}

bool MakesSense(const StoredJob& stored, int64_t end_ms) {
  const v1::Job& job = stored.job;
  uint64_t chunks = 0;
  for (const uint64_t bytes : job.surface().chunk_bytes()) chunks += bytes;
  return !job.job_id().empty() && IsFinished(job.state()) == (end_ms != 0) &&
         chunks == job.surface().total_bytes();
}

}  // namespace

JobRow EncodeJob(const StoredJob& stored, int64_t end_ms) {
  JobRow row{stored.header.SerializeAsString(), stored.job.SerializeAsString(), end_ms, 0};
  row.checksum = Checksum(stored, row);
  return row;
}

absl::Status DecodeJob(const JobRow& row, StoredJob* stored) {
  if (Checksum(*stored, row) == row.checksum && stored->header.ParseFromString(row.header) &&
      stored->job.ParseFromString(row.job) && MakesSense(*stored, row.end_ms)) {
    return absl::OkStatus();
  }
  return absl::DataLossError("the record of a job is damaged");
}

}  // namespace rilievo
