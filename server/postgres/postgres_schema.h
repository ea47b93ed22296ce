// The tables of a store in PostgreSQL, and how older ones become them.
#pragma once

#include "absl/status/status.h"
#include "server/store/database.h"

namespace rilievo {

// Makes what is missing: several servers may begin with an empty database at once, and servers of
// the version before may be at work. UNAVAILABLE when a later version made tables that this one
// must not work with.
absl::Status MakePostgresTables(Database* database);

}  // namespace rilievo
