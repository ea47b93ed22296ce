#include "core/base/unnamed_file.h"

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include <cerrno>

namespace rilievo {

int OpenUnnamedFile(const std::string& folder) {
  constexpr int kOwnerAlone = 0600;
  const int number = open(folder.c_str(), O_TMPFILE | O_EXCL | O_RDWR | O_CLOEXEC, kOwnerAlone);
  // Some file systems, such as NFS, have no such files.
  if (number >= 0 || (errno != EOPNOTSUPP && errno != EISDIR)) return number;
  std::string name = folder + "/rilievo-scratch-XXXXXX";
  const int named = mkostemp(name.data(), O_CLOEXEC);
  if (named >= 0) unlink(name.c_str());
  return named;
}

}  // namespace rilievo
