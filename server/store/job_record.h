// A job as the store keeps it, and whether its record is as it was written.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "rilievo/v1/jobs.pb.h"

namespace rilievo {

// `job` is what its client sees.
struct StoredJob {
  std::string owner = {};             // whose jobs it is among; empty: nobody's in particular
  std::string client = {};            // whose turn it takes in the queue
  v1::ReconstructHeader header = {};  // without a control mesh that was given: that is `mesh`
  std::string surface = {};           // its blob; empty before it succeeded
  v1::Job job = {};
  std::string mesh = {};  // blob of a v1::ControlMesh; empty without one
  // Attempts that ended with the server or with a worker that was killed, since the last clean end.
  int unclean_ends = 0;
  // In a shared store: whose work it is (JobClaim), 0 and nobody's without; not part of the record.
  int64_t claim = 0;
  std::string worker = {};
  int64_t memory = 0;  // that it may need, bytes, by estimate; for those who choose what to work on
  int64_t parts_bytes = 0;  // that the store keeps free for what comes of its parts
};

// From so many unclean ends on a job is worked on alone, and when nothing else waits: it may take
// others along.
inline constexpr int kSuspectEnds = 3;
inline bool IsSuspect(const StoredJob& stored) { return stored.unclean_ends >= kSuspectEnds; }

inline bool IsFinished(v1::JobState state) {
  return state == v1::JOB_STATE_SUCCEEDED || state == v1::JOB_STATE_FAILED ||
         state == v1::JOB_STATE_CANCELLED;
}

// What a job's record takes of its owner's share, bytes: row, indexes, report.
inline constexpr int64_t kJobRecordBytes = 2048;

// A row of the table of jobs.
struct JobRow {
  std::string header, job;  // serialized
  int64_t end_ms = 0;       // when it was finished, by the store's clock; 0 before
  int64_t checksum = 0;
};

JobRow EncodeJob(const StoredJob& stored, int64_t end_ms);

// Fills in header and job of `stored`, whose other fields were read from the row. DATA_LOSS when
// the row is not what was written, or makes no sense.
absl::Status DecodeJob(const JobRow& row, StoredJob* stored);

}  // namespace rilievo
