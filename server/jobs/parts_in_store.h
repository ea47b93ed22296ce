// The parts of a large job, shared by the store with the workers of a fleet.
#pragma once

#include <optional>
#include <stop_token>
#include <string>
#include <utility>

#include "core/paging/shared_parts.h"
#include "server/conversion/server_options.h"
#include "server/store/job_store.h"

namespace rilievo {

// One attempt's share. CANCELLED once a stop is requested; ABORTED when the job ended or goes on
// elsewhere, and when a part turned out to be damaged, which is done again then; UNAVAILABLE where
// the store is.
class PartsInStore final : public SharedParts {
 public:
  // `job`: with the claim and the name of the worker that leads; of one that helps, without a
  // claim. `store` outlives it.
  PartsInStore(JobStore* store, const StoredJob& job, const ServerOptions& options,
               std::stop_token stop);
  // What was begun is free for others.
  ~PartsInStore() override;

  bool leads() const override { return worker_.claim != 0; }
  absl::StatusOr<Turn> Next(PartStep step, int count) override;
  absl::Status Keep(PartStep step, int part, const PieceSource& next) override;
  absl::Status Fetch(PartStep step, int part, const PieceSink& take) override;

  // What its parts depend on besides the job.
  static std::string Recipe(const ServerOptions& options);

  // How many parts were kept.
  int kept() const { return kept_; }

 private:
  absl::StatusOr<PartQueue::Turn> TryNext(PartStep step, int count);

  JobStore* const store_;
  const PartWorker worker_;
  const std::stop_token stop_;
  bool begun_ = false;
  std::optional<PartClaim> claim_;
  int kept_ = 0;
};

}  // namespace rilievo
