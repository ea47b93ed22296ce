#include "client/cli/manual_page.h"

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "client/cli/exit_code.h"

namespace rilievo {
namespace {

// Text as troff reads it: no backslash, dash or leading dot with a meaning of its own.
std::string Troff(absl::string_view text) {
  std::string escaped = absl::StrReplaceAll(text, {{"\\", "\\e"}, {"-", "\\-"}});
  escaped = absl::StrReplaceAll(escaped, {{"\n.", "\n\\&."}, {"\n'", "\n\\&'"}});
  if (!escaped.empty() && (escaped[0] == '.' || escaped[0] == '\'')) escaped.insert(0, "\\&");
  return escaped;
}

std::string Header(const char* name, const char* section, const char* words) {
  return absl::StrCat(".\\\" Made from the program's own descriptions.\n.TH ", name, " ", section,
                      " \"\" \"rilievo " RILIEVO_VERSION "\" \"Rilievo\"\n.SH NAME\n",
                      absl::AsciiStrToLower(name), " \\- ", words, "\n");
}

std::string ItemOf(const OptionOutline& option) {
  std::string names = absl::StrJoin(option.names, ", ", [](std::string* out, const auto& name) {
    absl::StrAppend(out, "\\fB", Troff(name), "\\fR");
  });
  if (option.positional) names = absl::StrCat("\\fI", Troff(option.names[0]), "\\fR");
  if (!option.positional && option.takes_value()) {
    absl::StrAppend(&names, " \\fI", Troff(option.placeholder), "\\fR");
  }
  std::string item = absl::StrCat(".TP\n", names, "\n", Troff(option.text), "\n");
  if (!option.choices.empty()) {
    absl::StrAppend(&item, "(", Troff(absl::StrJoin(option.choices, ", ")), ")\n");
  }
  return item;
}

std::string SynopsisOf(const CommandOutline& command) {
  std::string line = absl::StrCat("rilievo ", absl::StrJoin(command.path, " "));
  for (const OptionOutline& option : command.options) {
    if (!option.required) continue;
    absl::StrAppend(&line, " ",
                    option.positional ? option.names[0]
                                      : absl::StrCat(option.names[0], " ", option.placeholder),
                    option.many ? " ..." : "");
  }
  return line;
}

std::string ExitStatus() {
  std::string section = ".SH EXIT STATUS\n";
  for (absl::string_view line : absl::StrSplit(kExitCodeHelp, '\n')) {
    line = absl::StripAsciiWhitespace(line);
    if (line.empty() || !absl::ascii_isdigit(static_cast<unsigned char>(line[0]))) continue;
    absl::StrAppend(&section, ".TP\n\\fB", std::string(line.substr(0, 1)), "\\fR\n",
                    Troff(absl::StripAsciiWhitespace(line.substr(1))), "\n");
  }
  return section;
}

constexpr char kExamples[] =
    ".SH EXAMPLES\n"
    ".nf\n"
    "rilievo diagnose scan.ply\n"
    "rilievo reconstruct scan.ply \\-o surface.dss\n"
    "rilievo convert mesh.stl \\-o surface.dss\n"
    "rilievo reconstruct *.ply \\-o surfaces/\n"
    "rilievo reconstruct \\- \\-o \\- < scan.laz.gz > surface.dss\n"
    "rilievo view surface.dss \\-o turning.png \\-\\-turntable 24\n"
    "source <(rilievo completion bash)\n"
    ".fi\n";

}  // namespace

std::string ManualOfProgram(const std::vector<CommandOutline>& commands) {
  std::string page = Header(
      "RILIEVO", "1", "point clouds to displaced subdivision surfaces, and what to do with them");
  page += ".SH SYNOPSIS\n.B rilievo\n.I COMMAND\n[\\fIOPTIONS\\fR]\n.SH DESCRIPTION\n";
  absl::StrAppend(
      &page, Troff(commands.front().text),
      "\nFiles are told apart by their first bytes, then by their extension. A file named "
      "\\fB\\-\\fR is the standard input or output.\n.SH COMMANDS\n");
  for (const CommandOutline& command : commands) {
    if (command.path.empty() || !command.children.empty()) continue;
    absl::StrAppend(&page, ".SS ", Troff(SynopsisOf(command)), "\n", Troff(command.text), ".\n");
    for (const OptionOutline& option : command.options) page += ItemOf(option);
  }
  return absl::StrCat(page, ExitStatus(), kExamples, ".SH SEE ALSO\n.BR rilievod (8)\n");
}

std::string ManualOfServer(absl::string_view help) {
  std::string page = Header("RILIEVOD", "8", "server that reconstructs surfaces from point clouds");
  page += ".SH SYNOPSIS\n.B rilievod\n[\\fIOPTIONS\\fR]\n.SH DESCRIPTION\n";
  bool in_options = false;
  for (absl::string_view line : absl::StrSplit(help, '\n')) {
    const absl::string_view words = absl::StripAsciiWhitespace(line);
    if (words.empty() || absl::StartsWith(words, "Usage:")) continue;
    if (absl::StartsWith(words, "Options:") || absl::StartsWith(words, "OPTIONS:")) {
      in_options = true;
      page += ".SH OPTIONS\n";
    } else if (in_options && words[0] == '-') {
      // "-h,--help TEXT [default]    what it does"
      const size_t gap = words.find("  ");
      absl::StrAppend(&page, ".TP\n\\fB", Troff(words.substr(0, gap)), "\\fR\n");
      if (gap != absl::string_view::npos) {
        absl::StrAppend(&page, Troff(absl::StripLeadingAsciiWhitespace(words.substr(gap))), "\n");
      }
    } else {
      absl::StrAppend(&page, Troff(words), "\n");
    }
  }
  return absl::StrCat(
      page,
      ".SH EXIT STATUS\n0 after SIGTERM or SIGINT and the end of running jobs, 1 when "
      "the server cannot start.\n.SH SEE ALSO\n.BR rilievo (1)\n");
}

}  // namespace rilievo
