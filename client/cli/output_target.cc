#include "client/cli/output_target.h"

#include <unistd.h>

#include <algorithm>
#include <iostream>
#include <optional>

#include "absl/strings/str_cat.h"
#include "client/cli/exit_code.h"
#include "client/cli/file_identity.h"
#include "client/formats/atomic_file.h"
#include "client/formats/file_kind.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr char kStandardInput[] = "the standard input";

struct NamedFile {
  std::string name;  // as people gave it
  FileIdentity identity;
};

void AppendFiles(const std::vector<std::string>& paths, int standard_descriptor,
                 const char* standard, std::vector<NamedFile>* files) {
  for (const std::string& path : paths) {
    if (path.empty()) continue;
    const std::optional<FileIdentity> identity = IdentityOf(path, standard_descriptor);
    if (identity) files->push_back({path == "-" ? standard : path, *identity});
  }
}

// A result never replaces what it is made from, nor another result.
absl::Status CheckApart(const CommandFiles& files) {
  std::vector<NamedFile> inputs, outputs;
  AppendFiles(files.inputs, STDIN_FILENO, kStandardInput, &inputs);
  AppendFiles(files.outputs, STDOUT_FILENO, "the standard output", &outputs);
  AppendFiles(files.text, STDOUT_FILENO, "the standard output", &outputs);
  for (size_t i = 0; i < outputs.size(); ++i) {
    const auto [name, identity] = outputs[i];
    const auto same = [&](const NamedFile& file) { return file.identity == identity; };
    const auto input = std::find_if(inputs.begin(), inputs.end(), same);
    if (input != inputs.end()) {
      const std::string overwritten = input->name == name             ? "the input"
                                      : input->name == kStandardInput ? input->name
                                                                      : "the input " + input->name;
      return UsageError(
          absl::StrCat(name, ": this output would overwrite ", overwritten, "; name another file"));
    }
    const auto before = outputs.begin() + static_cast<std::ptrdiff_t>(i);
    const auto other = std::find_if(outputs.begin(), before, same);
    if (other != before) {
      return UsageError(absl::StrCat(
          name, ": two outputs would go to this file", other->name == name ? "" : ", also as ",
          other->name == name ? "" : other->name, "; name another file for one of them"));
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckFiles(const CommandFiles& files) {
  if (std::count(files.inputs.begin(), files.inputs.end(), "-") > 1) {
    return UsageError("the standard input can be read once only; '-' is there twice");
  }
  const auto at_standard =
      std::count_if(files.outputs.begin(), files.outputs.end(), IsStandardOutput);
  if (at_standard + std::count_if(files.text.begin(), files.text.end(), IsStandardOutput) > 1) {
    return UsageError("two results cannot both go to the standard output; name a file for one");
  }
  RILIEVO_RETURN_IF_ERROR(CheckApart(files));
  if (at_standard > 0 && isatty(STDOUT_FILENO) != 0) {
    return UsageError(
        "-: the standard output is a terminal, which shows no such bytes; name a file, or send "
        "them on with > or |");
  }
  for (const auto* outputs : {&files.outputs, &files.text}) {
    for (const std::string& path : *outputs) {
      if (path.empty()) continue;
      RILIEVO_RETURN_IF_ERROR(WithExitCode(CheckWritable(path), ExitCode::kOutput));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckExtension(const std::string& output, const std::string& extension,
                            const std::string& what) {
  const std::string given = Extension(output);
  if (given.empty() || given == extension) return absl::OkStatus();
  return UsageError(
      absl::StrCat("--output ", output, ": ", what, "; give the name the extension .", extension));
}

std::ostream& WordsBeside(const std::string& output) {
  return IsStandardOutput(output) ? std::cerr : std::cout;
}

absl::Status WriteText(const std::string& path, const std::string& text) {
  return WithExitCode(WriteFileAtomically(path,
                                          [&](std::ostream& out) {
                                            out << text;
                                            return absl::OkStatus();
                                          }),
                      ExitCode::kOutput);
}

}  // namespace rilievo
