// How many files and connections this process may have open.
#pragma once

namespace rilievo {

// As many as its hard limit allows: the soft limit is 1024 on most machines, for programs that use
// select(). Where the system refuses, nothing changes.
void RaiseOpenFiles();

}  // namespace rilievo
