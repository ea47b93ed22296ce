// Another program that runs for as long as this one wants it.
#pragma once

#include <sys/types.h>

#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "server/os/file_descriptor.h"

namespace rilievo {

class ChildProgram {
 public:
  // Starts `words[0]`, looked for in PATH, with no signal blocked or ignored. Its standard
  // input is a pipe without content that ends with this process; its errors go where ours do.
  // NOT_FOUND where there is no such program.
  static absl::StatusOr<ChildProgram> Start(const std::vector<std::string>& words);

  ChildProgram(ChildProgram&& other) noexcept;
  ChildProgram& operator=(ChildProgram&&) = delete;
  // Asks it to end, and waits for that.
  ~ChildProgram();

  // The next line that it prints, without its end; none once its output has ended or `stop` is
  // requested.
  std::optional<std::string> ReadLine(std::stop_token stop);

 private:
  ChildProgram(pid_t process, FileDescriptor input, FileDescriptor output)
      : process_(process), input_(std::move(input)), output_(std::move(output)) {}

  pid_t process_;
  FileDescriptor input_, output_;
  std::string read_;
};

}  // namespace rilievo
