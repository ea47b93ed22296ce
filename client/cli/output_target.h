// What a command reads, and where its results go: files, or the standard input and output.
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "absl/status/status.h"

namespace rilievo {

inline bool IsStandardOutput(const std::string& path) { return path == "-"; }

// Of a command. "-" is the standard input or output; empty paths are passed over.
struct CommandFiles {
  std::vector<std::string> inputs = {};
  std::vector<std::string> outputs = {};  // bytes
  std::vector<std::string> text = {};     // outputs that people can read
};

// Asked before anything is read: OK when no output is an input or another output, under whatever
// name, and something could be written to each. An error has the exit code kOutput where nothing
// can be written; else kUsage, also when bytes would go to a terminal, and when two inputs are the
// standard input or two outputs the standard output.
absl::Status CheckFiles(const CommandFiles& files);

// kUsage when `output` has another extension than the one of what is written to it; `what` says
// what that is.
absl::Status CheckExtension(const std::string& output, const std::string& extension,
                            const std::string& what);

// What is said to people: the standard output, unless a result goes there.
std::ostream& WordsBeside(const std::string& output);

// Writes all of `text` to `path` (see WriteFileAtomically); an error has the exit code kOutput.
absl::Status WriteText(const std::string& path, const std::string& text);

}  // namespace rilievo
