// Where a server's jobs are kept: programs that know more than folders say so.
#pragma once

#include <functional>
#include <memory>

#include "absl/status/statusor.h"
#include "server/conversion/server_options.h"
#include "server/store/job_store.h"

namespace rilievo {

using OpenStore = std::function<absl::StatusOr<std::unique_ptr<JobStore>>(
    const ServerOptions& options, StoreSettings settings)>;

// options.store is a folder.
inline absl::StatusOr<std::unique_ptr<JobStore>> OpenFolder(const ServerOptions& options,
                                                            StoreSettings settings) {
  return JobStore::Open(options.store, std::move(settings));
}

}  // namespace rilievo
