// Files that are nobody else's.
#pragma once

#include <string>

#include "absl/status/status.h"

namespace rilievo {

// What this process makes from now on its user alone may read, and no other process of that user's
// reads its memory; it leaves no core file. Not under a sanitizer, which looks into it at the end.
void KeepToThisUser();

// Makes a file that its owner alone may read. ALREADY_EXISTS when there is one of that name.
absl::Status WriteSecret(const std::string& path, const std::string& text);

// Whether users other than the owner and its group may read, write or search it; false for what is
// not there.
bool IsOpenToOthers(const std::string& path);

}  // namespace rilievo
