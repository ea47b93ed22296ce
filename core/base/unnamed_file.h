// Files that go with the process that has them open.
#pragma once

#include <string>

namespace rilievo {

// The number of a new, empty file in `folder` without a name; -1, and errno then.
int OpenUnnamedFile(const std::string& folder);

}  // namespace rilievo
