// The arrows between the rooms, as docs/architecture.md draws them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace rilievo {
namespace {

namespace fs = std::filesystem;

const fs::path kSource = RILIEVO_SOURCE_FOLDER;

std::string TextOf(const fs::path& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

std::vector<std::string> Names(const std::string& text) {
  const std::regex name("[a-z][a-z/]*");
  return {std::sregex_token_iterator(text.begin(), text.end(), name), {}};
}

// By room: the rooms it may include. `arrows`: chains "a <- {b, c} <- d" with semicolons between.
std::map<std::string, std::set<std::string>> Parse(const std::string& arrows) {
  std::map<std::string, std::set<std::string>> allowed;
  std::stringstream chains(arrows);
  for (std::string chain; std::getline(chains, chain, ';');) {
    std::set<std::string> before;
    for (size_t begin = 0; begin <= chain.size();) {
      const size_t end = std::min(chain.find("<-", begin), chain.size());
      const std::vector<std::string> group = Names(chain.substr(begin, end - begin));
      for (const std::string& room : group) allowed[room].insert(before.begin(), before.end());
      before.insert(group.begin(), group.end());
      begin = end + 2;
    }
  }
  return allowed;
}

std::map<std::string, std::set<std::string>> Allowed() {
  const std::string text = TextOf(kSource / "docs" / "architecture.md");
  const std::string start = "Arrows point one way:";
  const size_t begin = text.find(start);
  if (begin == std::string::npos) return {};
  const size_t from = begin + start.size();
  return Parse(text.substr(from, text.find('.', from) - from));
}

// The room of a header's or a source's path, "" for those of no room.
std::string RoomOf(const std::string& path) {
  std::smatch match;
  if (std::regex_search(path, match, std::regex("^core/([a-z]+)/"))) return match[1];
  if (path.starts_with("rilievo/v1/")) return "proto";
  if (path.starts_with("tests/scans/")) return "tests/scans";
  for (const std::string room : {"server", "client", "proto"}) {
    if (path.starts_with(room + "/")) return room;
  }
  return "";
}

TEST(LayeringTest, ReadsChains) {
  const auto allowed = Parse("base <- {scan, loop} <- codec; proto <- codec");
  EXPECT_THAT(allowed.at("loop"), testing::ElementsAre("base"));
  EXPECT_THAT(allowed.at("codec"), testing::ElementsAre("base", "loop", "proto", "scan"));
  EXPECT_THAT(allowed.at("proto"), testing::IsEmpty());
}

TEST(LayeringTest, EveryRoomIsInTheOutline) {
  const auto allowed = Allowed();
  for (const fs::directory_entry& room : fs::directory_iterator(kSource / "core")) {
    if (!room.is_directory()) continue;
    EXPECT_TRUE(allowed.contains(room.path().filename().string())) << room.path();
  }
}

TEST(LayeringTest, NoFileIncludesAgainstTheArrows) {
  const auto allowed = Allowed();
  ASSERT_FALSE(allowed.empty()) << "docs/architecture.md draws no arrows";
  const std::regex include("#include \"([^\"]+)\"");
  int includes = 0;
  for (const char* folder : {"core", "server", "client", "proto", "tests/scans"}) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(kSource / folder)) {
      const std::string extension = entry.path().extension();
      if (extension != ".cc" && extension != ".h") continue;
      const std::string from = RoomOf(fs::relative(entry.path(), kSource).string());
      const std::string text = TextOf(entry.path());
      for (std::sregex_iterator match(text.begin(), text.end(), include), end; match != end;
           ++match) {
        const std::string header = (*match)[1];
        const std::string to = RoomOf(header);
        if (to.empty() && !header.starts_with("tests/")) continue;  // another library's
        ++includes;
        if (to == from) continue;
        const auto rooms = allowed.find(from);
        EXPECT_TRUE(rooms != allowed.end() && rooms->second.contains(to))
            << entry.path() << " includes " << header;
      }
    }
  }
  EXPECT_GT(includes, 500);
}

}  // namespace
}  // namespace rilievo
