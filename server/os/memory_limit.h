// How much memory there is for this process.
#pragma once

#include <cstdint>
#include <string>

namespace rilievo {

// Bytes: of the container (cgroup v2 or v1), else of the machine.
int64_t MemoryForThisProcess();

// The smallest limit that the files say; `root`: of the file system.
int64_t MemoryLimit(const std::string& root);

}  // namespace rilievo
