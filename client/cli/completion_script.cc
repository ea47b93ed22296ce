#include "client/cli/completion_script.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"

namespace rilievo {
namespace {

std::string PathOf(const CommandOutline& command) { return absl::StrJoin(command.path, " "); }

// Between single quotes, in bash, zsh and fish alike.
std::string Quoted(const std::string& text) {
  return absl::StrCat("'", absl::StrReplaceAll(text, {{"'", "'\\''"}}), "'");
}

// What may follow a command but for its options: its commands, or choices of its positionals.
std::vector<std::string> PlainWords(const CommandOutline& command) {
  std::vector<std::string> words = command.children;
  for (const OptionOutline& option : command.options) {
    if (option.positional) words.insert(words.end(), option.choices.begin(), option.choices.end());
  }
  return words;
}

// Lines of a shell's `case` that find the command among the words typed so far; the same in bash
// and zsh.
std::string FindCommand(const std::vector<CommandOutline>& commands) {
  std::string lines;
  for (const CommandOutline& command : commands) {
    if (command.path.empty()) continue;
    const std::string before = absl::StrJoin(command.path.begin(), command.path.end() - 1, " ");
    absl::StrAppend(&lines, "      ", Quoted(absl::StrCat(before, "/", command.path.back())),
                    ") command=", Quoted(PathOf(command)), " ;;\n");
  }
  return lines;
}

std::string ValuesForBash(const CommandOutline& command) {
  std::string lines;
  for (const OptionOutline& option : command.options) {
    if (option.positional || !option.takes_value()) continue;
    if (option.choices.empty() && !option.takes_number()) continue;  // a file
    std::vector<std::string> patterns;
    for (const std::string& name : option.names) {
      patterns.push_back(Quoted(absl::StrCat(PathOf(command), ":", name)));
    }
    absl::StrAppend(&lines, "    ", absl::StrJoin(patterns, "|"), ") ",
                    option.takes_number()
                        ? "compopt +o default 2>/dev/null; "
                        : absl::StrCat("words=", Quoted(absl::StrJoin(option.choices, " ")), "; "),
                    "only=1 ;;\n");
  }
  return lines;
}

std::string NamesOf(const CommandOutline& command) {
  std::vector<std::string> names;
  for (const OptionOutline& option : command.options) {
    if (!option.positional) names.insert(names.end(), option.names.begin(), option.names.end());
  }
  return absl::StrJoin(names, " ");
}

// For _arguments: '--output[text]:FILE:_files'.
std::string ZshOption(const OptionOutline& option) {
  const std::string text =
      absl::StrReplaceAll(option.text, {{"[", "("}, {"]", ")"}, {":", "\\:"}, {"'", "'\\''"}});
  const std::string values = option.choices.empty()
                                 ? option.takes_number() ? " " : "_files"
                                 : absl::StrCat("(", absl::StrJoin(option.choices, " "), ")");
  if (option.positional) return absl::StrCat("'*:", option.names[0], ":", values, "'");
  std::vector<std::string> specs;
  for (const std::string& name : option.names) {
    specs.push_back(absl::StrCat(
        "'", name, "[", text, "]",
        option.takes_value() ? absl::StrCat(":", option.placeholder, ":", values) : "", "'"));
  }
  return absl::StrJoin(specs, " \\\n        ");
}

std::string ZshCase(const std::vector<CommandOutline>& commands, const CommandOutline& command) {
  std::string lines = absl::StrCat("    ", Quoted(PathOf(command)), ")\n");
  if (!command.children.empty()) {
    std::vector<std::string> children;
    for (const CommandOutline& child : commands) {
      if (child.path.size() != command.path.size() + 1 ||
          !std::equal(command.path.begin(), command.path.end(), child.path.begin())) {
        continue;
      }
      children.push_back(Quoted(absl::StrCat(child.path.back(), ":", child.text)));
    }
    absl::StrAppend(&lines, "      local -a commands=(", absl::StrJoin(children, " "),
                    ")\n      _describe command commands\n");
  }
  std::vector<std::string> specs;
  bool positional = false;
  for (const OptionOutline& option : command.options) {
    if (option.positional && positional) continue;  // _arguments takes one rest
    positional |= option.positional;
    specs.push_back(ZshOption(option));
  }
  absl::StrAppend(&lines, "      _arguments -s ", absl::StrJoin(specs, " \\\n        "),
                  "\n      ;;\n");
  return lines;
}

// The condition under which fish offers what follows `command`.
std::string FishCondition(const CommandOutline& command) {
  if (command.path.empty()) return "__fish_use_subcommand";
  std::vector<std::string> conditions;
  for (const std::string& word : command.path) {
    conditions.push_back("__fish_seen_subcommand_from " + word);
  }
  if (!command.children.empty()) {
    conditions.push_back("not __fish_seen_subcommand_from " + absl::StrJoin(command.children, " "));
  }
  return absl::StrJoin(conditions, "; and ");
}

}  // namespace

std::string BashCompletion(const std::vector<CommandOutline>& commands) {
  std::string script =
      "# Completion of rilievo for bash: source <(rilievo completion bash)\n"
      "_rilievo() {\n"
      "  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]}\n"
      "  local command='' words='' names='' only='' i\n"
      "  for ((i = 1; i < COMP_CWORD; ++i)); do\n"
      "    case \"$command/${COMP_WORDS[i]}\" in\n";
  absl::StrAppend(&script, FindCommand(commands),
                  "    esac\n  done\n  case \"$command:$previous\" in\n");
  for (const CommandOutline& command : commands) script += ValuesForBash(command);
  script += "  esac\n  if [ -z \"$only\" ]; then\n    case \"$command\" in\n";
  for (const CommandOutline& command : commands) {
    absl::StrAppend(&script, "      ", Quoted(PathOf(command)),
                    ") names=", Quoted(NamesOf(command)),
                    " words=", Quoted(absl::StrJoin(PlainWords(command), " ")), " ;;\n");
  }
  return script +
         "    esac\n"
         "    case \"$current\" in -*) words=$names ;; esac\n"
         "  fi\n"
         "  mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$current\")\n"
         "}\n"
         "complete -o default -F _rilievo rilievo\n";
}

std::string ZshCompletion(const std::vector<CommandOutline>& commands) {
  std::string script =
      "#compdef rilievo\n"
      "# Completion of rilievo for zsh: source <(rilievo completion zsh)\n"
      "_rilievo() {\n"
      "  local command='' word\n"
      "  for word in \"${(@)words[2,CURRENT-1]}\"; do\n"
      "    case \"$command/$word\" in\n";
  absl::StrAppend(&script, FindCommand(commands), "    esac\n  done\n  case \"$command\" in\n");
  for (const CommandOutline& command : commands) script += ZshCase(commands, command);
  return script +
         "  esac\n"
         "}\n"
         "if [ \"$funcstack[1]\" = _rilievo ]; then _rilievo \"$@\"; else compdef _rilievo "
         "rilievo; fi\n";
}

std::string FishCompletion(const std::vector<CommandOutline>& commands) {
  std::string script = "# Completion of rilievo for fish: rilievo completion fish | source\n";
  for (const CommandOutline& command : commands) {
    if (!command.path.empty()) {
      CommandOutline parent = command;
      parent.path.pop_back();
      for (const CommandOutline& other : commands) {
        if (other.path == parent.path) parent = other;
      }
      absl::StrAppend(&script, "complete -c rilievo -f -n ", Quoted(FishCondition(parent)), " -a ",
                      command.path.back(), " -d ", Quoted(command.text), "\n");
    }
    for (const OptionOutline& option : command.options) {
      std::string line = absl::StrCat("complete -c rilievo -n ", Quoted(FishCondition(command)));
      if (option.positional) {
        if (option.choices.empty()) continue;
        absl::StrAppend(&script, line, " -f -a ", Quoted(absl::StrJoin(option.choices, " ")), "\n");
        continue;
      }
      for (const std::string& name : option.names) {
        absl::StrAppend(&line, name.size() == 2 ? " -s " : " -l ",
                        name.substr(name.size() == 2 ? 1 : 2));
      }
      if (!option.choices.empty()) {
        absl::StrAppend(&line, " -x -a ", Quoted(absl::StrJoin(option.choices, " ")));
      } else if (option.takes_value()) {
        line += option.takes_number() ? " -x" : " -r -F";
      }
      absl::StrAppend(&script, line, " -d ", Quoted(option.text), "\n");
    }
  }
  return script;
}

}  // namespace rilievo
