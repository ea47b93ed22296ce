#include "server/command_line/usage_message.h"

#include <algorithm>
#include <filesystem>
#include <numeric>
#include <regex>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

namespace fs = std::filesystem;

// Insertions, deletions, replacements (Levenshtein 1966).
size_t EditDistance(const std::string& a, const std::string& b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (size_t i = 1; i <= a.size(); ++i) {
    size_t diagonal = row[0];
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, replaced});
    }
  }
  return row.back();
}

const CLI::App& DeepestParsed(const CLI::App& program) {
  const auto parsed = program.get_subcommands();
  return parsed.empty() ? program : DeepestParsed(*parsed.front());
}

std::string PathOf(const CLI::App& app) {
  return app.get_parent() == nullptr ? app.get_name()
                                     : absl::StrCat(PathOf(*app.get_parent()), " ", app.get_name());
}

// What "scan.ply" alone may ask for.
std::string CommandsForFile(const fs::path& path) {
  const std::string file = path.string(), stem = path.stem().string();
  if (path.extension() == ".dss") {
    return absl::StrCat("rilievo info ", file, "\nrilievo view ", file, " -o ", stem, ".png");
  }
  const bool is_mesh = path.extension() == ".stl" || path.extension() == ".glb";
  return absl::StrCat("rilievo ", is_mesh ? "convert " : "reconstruct ", file, " -o ", stem,
                      ".dss");
}

bool NamesAFile(const std::string& word) {
  std::error_code error;
  return fs::exists(word, error) || fs::path(word).has_extension();
}

std::string WrongCommand(const CLI::App& app, const std::string& word) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (!command->get_group().empty()) names.push_back(command->get_name());
  }
  const std::string all = absl::StrCat("the commands are ", absl::StrJoin(names, ", "));
  if (word.empty()) return absl::StrCat("a command is missing; ", all);
  const std::string nearest = Nearest(word, names);
  if (!nearest.empty()) {
    return absl::StrCat("'", word, "' is not a command; did you mean '", nearest, "'?");
  }
  if (app.get_parent() == nullptr && NamesAFile(word)) {
    return absl::StrCat("'", word, "' is a file, not a command; did you mean:\n",
                        CommandsForFile(word));
  }
  return absl::StrCat("'", word, "' is not a command; ", all);
}

// Of names with two dashes: the one that begins with that letter; "" where none or several do.
std::string OnlyOneWith(char letter, const std::vector<std::string>& names) {
  const auto begins = [&](const std::string& name) { return name[2] == letter; };
  if (std::count_if(names.begin(), names.end(), begins) != 1) return "";
  return *std::find_if(names.begin(), names.end(), begins);
}

// Whether the last word, behind another that is not an option, names a file which is not there yet.
bool EndsWithAnOutput(const std::vector<std::string>& words) {
  if (words.size() < 3) return false;
  const std::string& last = words.back();
  const std::string& before = words[words.size() - 2];
  const std::string extension = fs::path(last).extension().string();
  std::error_code error;
  return !absl::StartsWith(last, "-") && !absl::StartsWith(before, "-") && extension.size() > 1 &&
         absl::ascii_isalpha(static_cast<unsigned char>(extension[1])) && !fs::exists(last, error);
}

std::string UnexpectedWords(const CLI::App& app, const std::vector<std::string>& extra) {
  const std::string& word = extra.front();
  if (word.size() < 2 || word[0] != '-') {
    return absl::StrCat("'", word, "' is one word too many");
  }
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  const std::string name = word.substr(0, word.find('='));
  const std::string nearest = name[1] == '-' ? Nearest(name, names) : OnlyOneWith(name[1], names);
  return absl::StrCat(name, " is not an option",
                      nearest.empty() ? "" : absl::StrCat("; did you mean ", nearest, "?"));
}

// "0.000001" of CLI11 as "1e-06", "0.100000" as "0.1".
std::string Number(const std::string& text) { return absl::StrCat(std::stod(text)); }

// CLI11's own sentence in ours.
std::string Reworded(const CLI::App& app, const std::string& sentence) {
  std::smatch match;
  const auto is = [&](const char* pattern) {
    return std::regex_match(sentence, match, std::regex(pattern));
  };
  if (is("(.*) is required")) {
    const CLI::Option* option = app.get_option_no_throw(match[1]);
    const std::string text = option == nullptr ? "" : option->get_description();
    return absl::StrCat(match[1].str(), " is missing", text.empty() ? "" : ": ",
                        text.substr(0, text.find(';')));
  }
  if (is("Could not convert: (\\S+) = (.*)") || is("(\\S+): Value (.*) could not be converted.*")) {
    return absl::StrCat(match[1].str(), ": '", match[2].str(),
                        "' is not a number, or not a whole "
                        "one where that is needed");
  }
  if (is("(\\S+): Value (\\S+) not in range (\\S+) to (\\S+)")) {
    return absl::StrCat(match[1].str(), ": '", match[2].str(), "' is not a number from ",
                        Number(match[3]), " to ", Number(match[4]));
  }
  if (is("(\\S+): (.*) not in \\{(.*)\\}")) {
    return absl::StrCat(match[1].str(), ": '", match[2].str(), "' is not one of ",
                        absl::StrReplaceAll(match[3].str(), {{",", ", "}}));
  }
  if (is("(\\S+): (\\d+) required \\S+ missing")) {
    return absl::StrCat(
        match[1].str(), ": ",
        match[2] == "1" ? "its value is" : absl::StrCat(match[2].str(), " values are"), " missing");
  }
  if (is("(\\S+): At least (\\d+) required but received (\\d+)")) {
    return absl::StrCat(match[1].str(), ": ", match[2].str(), " values are needed, not ",
                        match[3].str());
  }
  if (is("(\\S+) excludes (\\S+)")) {
    return absl::StrCat(match[1].str(), " and ", match[2].str(),
                        " exclude each other; give one of them");
  }
  if (is("(\\S+) requires (\\S+)")) {
    return absl::StrCat(match[1].str(), " needs ", match[2].str(), " too");
  }
  return sentence;
}

// The first word that is neither the name of a parsed command nor an option.
std::string FirstStrayWord(const CLI::App& app, const std::vector<std::string>& words) {
  size_t depth = 0;
  for (const CLI::App* at = &app; at->get_parent() != nullptr; at = at->get_parent()) ++depth;
  for (const std::string& word : words) {
    if (!word.empty() && word[0] == '-') continue;
    if (depth == 0) return word;
    --depth;
  }
  return "";
}

}  // namespace

std::string Nearest(const std::string& word, const std::vector<std::string>& known) {
  std::string nearest;
  size_t least = word.size() / 3 + 1;
  for (const std::string& name : known) {
    const size_t distance = EditDistance(word, name);
    if (distance >= least) continue;
    least = distance;
    nearest = name;
  }
  return nearest;
}

std::string UsageMessage(const CLI::App& program, const std::vector<std::string>& words,
                         const CLI::ParseError& error) {
  const CLI::App& app = DeepestParsed(program);
  const std::vector<std::string> extra = program.remaining(/*recurse=*/true);
  // An option that is not known explains what is missing.
  const bool unknown_option = !extra.empty() && absl::StartsWith(extra.front(), "-");
  std::string what;
  if (unknown_option || (dynamic_cast<const CLI::ExtrasError*>(&error) && !extra.empty())) {
    what = UnexpectedWords(app, extra);
  } else if (absl::StartsWith(error.what(), "A subcommand")) {
    what = WrongCommand(app, FirstStrayWord(app, words));
  } else {
    what = Reworded(app, error.what());
    if (absl::StartsWith(error.what(), "--output ") && EndsWithAnOutput(words)) {
      absl::StrAppend(&what, "; did you mean -o ", words.back(), "?");
    }
  }
  return absl::StrCat(Wrap(absl::StrCat(PathOf(app), ": ", what), 2), "\n",
                      Wrap(absl::StrCat("See '", PathOf(app), " --help'."), 2), "\n");
}

}  // namespace rilievo
