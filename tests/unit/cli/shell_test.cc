// Completion and the manual: made from the options, so that none can be missing.
#include <regex>

#include "client/cli/command_outline.h"
#include "client/cli/completion_script.h"
#include "client/cli/manual_page.h"
#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

bool Exists(const std::string& program) {
  return std::system(("command -v " + program + " >/dev/null 2>&1").c_str()) == 0;
}

class ShellTest : public ProgramFixture {
 protected:
  std::string Output(const std::string& command) {
    EXPECT_EQ(std::system((command + " > " + At("shell") + " 2>&1").c_str()), 0)
        << command << "\n"
        << Content(At("shell"));
    return Content(At("shell"));
  }

  // What bash offers for the last of `words`.
  std::vector<std::string> Offered(const std::string& words) {
    std::ofstream script(At("ask.sh"));
    script << "source " << At("bash") << "\nCOMP_WORDS=(" << words
           << ")\nCOMP_CWORD=$((${#COMP_WORDS[@]} - 1))\n_rilievo\n"
           << "printf '%s\\n' \"${COMPREPLY[@]}\"\n";
    script.close();
    std::istringstream lines(Output("bash " + At("ask.sh")));
    std::vector<std::string> offered;
    for (std::string line; std::getline(lines, line);) {
      if (!line.empty()) offered.push_back(line);
    }
    return offered;
  }
};

TEST_F(ShellTest, BashOffersCommandsOptionsAndChoices) {
  std::ofstream(At("bash")) << Run({"completion", "bash"}).out;
  EXPECT_THAT(Offered("rilievo rec"), ElementsAre("reconstruct"));
  EXPECT_THAT(Offered("rilievo jobs ''"), ::testing::Contains("submit"));
  EXPECT_THAT(Offered("rilievo reconstruct --topo"), ElementsAre("--topology"));
  EXPECT_THAT(Offered("rilievo reconstruct a.ply --topology s"), ElementsAre("spherical"));
  EXPECT_THAT(Offered("rilievo jobs submit --crea"), ElementsAre("--creases"));
  EXPECT_THAT(Offered("rilievo jobs submit a.ply --creases o"), ElementsAre("off"));
  EXPECT_THAT(Offered("rilievo view a.dss --colors d"), ElementsAre("displacement"));
  EXPECT_THAT(Offered("rilievo completion z"), ElementsAre("zsh"));
  EXPECT_THAT(Offered("rilievo simulate gen"), ElementsAre("genus2"));
  // A file is left to the shell.
  EXPECT_THAT(Offered("rilievo reconstruct a.ply -o x"), ElementsAre());
}

TEST_F(ShellTest, OtherShellsReadTheirScripts) {
  for (const std::string shell : {"zsh", "fish"}) {
    const Ended script = Run({"completion", shell});
    ASSERT_EQ(script.code, 0);
    EXPECT_THAT(script.out, HasSubstr("topology"));
    EXPECT_THAT(script.out, HasSubstr("auto planar spherical arbitrary"));
    std::ofstream(At("script")) << script.out;
    if (Exists(shell)) Output(shell + " -n " + At("script"));
  }
}

// What stands before the key Tab, and the line it becomes.
const std::pair<const char*, const char*> kCompleted[] = {
    {"rec", "reconstruct"},
    {"jobs sub", "jobs submit"},
    {"reconstruct --topo", "reconstruct --topology"},
    {"reconstruct a.ply --topology s", "reconstruct a.ply --topology spherical"},
    {"jobs submit --crea", "jobs submit --creases"},
    {"jobs submit a.ply --creases of", "jobs submit a.ply --creases off"},
    {"view a.dss --colors d", "view a.dss --colors displacement"},
    {"completion z", "completion zsh"},
    {"simulate gen", "simulate genus2"},
};

TEST_F(ShellTest, ZshCompletesWhatIsTyped) {
  if (!Exists("zsh")) GTEST_SKIP() << "zsh is not installed (Debian package zsh)";
  // A terminal's shell, lines typed into it with Tab and Enter; `rilievo` there prints its words.
  std::ofstream(At("ask.zsh")) << R"zsh(zmodload zsh/zpty
zpty z zsh -f -i
zpty -w z "PS1= PS2=; $1; rilievo() { print -r -- \"GOT:\$*:END\" }; print READY\$((1 + 1))"
zpty -r -m z out '*READY2*'
shift
for line; do
  zpty -w z "rilievo $line"$'\t'
  zpty -r -m z out '*GOT:*:END*' && print -r -- "${${out##*GOT:}%%:END*}"
done
zpty -d z
)zsh";
  fs::create_directory(At("functions"));
  const std::string script = Run({"completion", "zsh"}).out;
  std::ofstream(At("functions/_rilievo")) << script;
  std::ofstream(At("rilievo.zsh")) << script;
  const std::string start = "autoload -Uz compinit && compinit -u -D";
  std::string words, expected;
  for (const auto& [typed, line] : kCompleted) {
    words += std::string(" '") + typed + "'";
    expected += std::string(line) + "\n";
  }
  // Read by hand, and from the folder of functions where the package puts it.
  for (const std::string& set_up : {start + "; source " + At("rilievo.zsh"),
                                    "fpath=(" + At("functions") + " $fpath); " + start}) {
    EXPECT_EQ(Output("timeout 60 zsh -f " + At("ask.zsh") + " '" + set_up + "'" + words), expected)
        << set_up;
  }
}

TEST_F(ShellTest, FishCompletesWhatIsTyped) {
  if (!Exists("fish")) GTEST_SKIP() << "fish is not installed (Debian package fish)";
  std::ofstream(At("rilievo.fish")) << Run({"completion", "fish"}).out;
  for (const auto& [typed, line] : kCompleted) {
    const std::string offered =
        Output("HOME=" + At("") + " fish -c \"source " + At("rilievo.fish") +
               "; complete -C 'rilievo " + typed + "'\"");
    // One line: the word, and what it means behind a tab.
    const std::string word = offered.substr(0, offered.find_first_of("\t\n"));
    EXPECT_EQ(std::count(offered.begin(), offered.end(), '\n'), 1) << offered;
    EXPECT_THAT(std::string("rilievo ") + line, ::testing::EndsWith(" " + word)) << typed;
  }
}

std::vector<std::string> LongOptionsOf(const std::string& help) {
  const std::regex option("--[a-z][a-z-]+");
  return {std::sregex_token_iterator(help.begin(), help.end(), option), {}};
}

TEST_F(ShellTest, TheManualNamesEveryOptionOfTheHelp) {
  const Ended page = Run({"manual"});
  ASSERT_EQ(page.code, 0) << page.err;
  std::string plain = std::regex_replace(page.out, std::regex("\\\\-"), "-");
  for (const char* command : {"reconstruct", "view", "diagnose", "export", "simulate"}) {
    EXPECT_THAT(plain, HasSubstr(std::string(".SS rilievo ") + command));
    for (const std::string& option : LongOptionsOf(Run({command, "--help"}).out)) {
      EXPECT_THAT(plain, HasSubstr("\\fB" + option + "\\fR")) << command;
    }
  }
  EXPECT_THAT(plain, HasSubstr(".SH EXIT STATUS"));
  EXPECT_THAT(plain, HasSubstr("cancelled (Ctrl-C)"));
  EXPECT_THAT(plain, Not(HasSubstr("manual")));  // made for packages
  std::ofstream(At("rilievo.1")) << page.out;
  if (Exists("groff")) {
    EXPECT_EQ(Output("groff -man -Tascii -ww -z " + At("rilievo.1")), "");
  }
}

TEST_F(ShellTest, TheManualOfTheServerComesFromItsHelp) {
  std::ofstream(At("help")) << "Serves.\nUsage: rilievod [OPTIONS]\n\nOptions:\n"
                               "  -h,--help                   Print this help message and exit\n"
                               "  --listen TEXT [127.0.0.1:1]  HOST:PORT; port 0 takes a free one\n"
                               "  --a-name-too-long-for-its-column TEXT\n"
                               "                              what it does\n";
  const std::string page = Run({"manual", "--of-server", At("help")}).out;
  EXPECT_THAT(page, HasSubstr("\\fB\\-\\-listen TEXT [127.0.0.1:1]\\fR\nHOST:PORT; port 0"));
  EXPECT_THAT(page, HasSubstr("column TEXT\\fR\nwhat it does"));
  EXPECT_THAT(page, HasSubstr(".SH DESCRIPTION\nServes."));
}

}  // namespace
}  // namespace rilievo
