// The arrows between the rooms, and between the wings of a room, as docs/architecture.md draws
// them.
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

// By name: the names whose headers it may include.
using Arrows = std::map<std::string, std::set<std::string>>;

std::string TextOf(const fs::path& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

std::vector<std::string> Names(const std::string& text) {
  const std::regex name("[a-z][a-z0-9_/]*");
  return {std::sregex_token_iterator(text.begin(), text.end(), name), {}};
}

// `chains`: such as "a <- {b, c} <- d", with semicolons between. What a name may include it may
// include through others as well.
Arrows Parse(const std::string& chains) {
  Arrows allowed;
  std::stringstream stream(chains);
  for (std::string chain; std::getline(stream, chain, ';');) {
    std::vector<std::string> before;
    for (size_t begin = 0; begin <= chain.size();) {
      const size_t end = std::min(chain.find("<-", begin), chain.size());
      const std::vector<std::string> group = Names(chain.substr(begin, end - begin));
      for (const std::string& name : group) allowed[name].insert(before.begin(), before.end());
      before = group;
      begin = end + 2;
    }
  }
  for (bool grew = true; grew;) {
    grew = false;
    for (auto& [name, included] : allowed) {
      const size_t count = included.size();
      for (const std::string& other : std::set<std::string>(included)) {
        included.insert(allowed[other].begin(), allowed[other].end());
      }
      grew = grew || included.size() > count;
    }
  }
  return allowed;
}

// The chains from `start` up to the end of their sentence; empty where the outline has none.
Arrows ArrowsAfter(const std::string& start) {
  static const std::string outline = TextOf(kSource / "docs" / "architecture.md");
  const size_t begin = outline.find(start);
  if (begin == std::string::npos) return {};
  const size_t from = begin + start.size();
  return Parse(outline.substr(from, outline.find('.', from) - from));
}

Arrows Rooms() { return ArrowsAfter("Arrows point one way:"); }
Arrows WingsOf(const std::string& room) { return ArrowsAfter("Within `" + room + "`:"); }

struct Place {
  std::string room;  // "" for files of no room
  std::string wing;  // the room's name for those in none of its wings
};

Place PlaceOf(const std::string& path) {
  std::smatch match;
  if (std::regex_search(path, match, std::regex("^(?:core/)?([a-z]+)/(?:([a-z0-9_]+)/)?"))) {
    const std::string room = match[1];
    const bool in_core = path.starts_with("core/");
    if (in_core || room == "server") return {room, match[2].matched ? match[2] : match[1]};
  }
  if (path.starts_with("rilievo/v1/")) return {"proto", "proto"};
  for (const std::string room : {"tests/scans", "server", "client", "proto"}) {
    if (path.starts_with(room + "/")) return {room, room};
  }
  return {};
}

bool Includes(const Arrows& arrows, const std::string& from, const std::string& to) {
  const auto found = arrows.find(from);
  return from == to || (found != arrows.end() && found->second.contains(to));
}

// Calls seen(path, header) for each include of a header in quotes. Paths from the top of the tree.
template <typename Seen>
void ForEachInclude(const Seen& seen) {
  const std::regex include("#include \"([^\"]+)\"");
  for (const char* folder : {"core", "server", "client", "proto", "tests/scans"}) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(kSource / folder)) {
      const std::string extension = entry.path().extension();
      if (extension != ".cc" && extension != ".h") continue;
      const std::string text = TextOf(entry.path());
      for (std::sregex_iterator match(text.begin(), text.end(), include), end; match != end;
           ++match) {
        seen(fs::relative(entry.path(), kSource).string(), (*match)[1].str());
      }
    }
  }
}

TEST(LayeringTest, ReadsChains) {
  const Arrows allowed = Parse("base <- {scan, loop} <- codec; proto <- codec");
  EXPECT_THAT(allowed.at("loop"), testing::ElementsAre("base"));
  EXPECT_THAT(allowed.at("codec"), testing::ElementsAre("base", "loop", "proto", "scan"));
  EXPECT_THAT(allowed.at("proto"), testing::IsEmpty());
}

TEST(LayeringTest, EveryRoomAndWingIsInTheOutline) {
  const Arrows rooms = Rooms();
  for (const fs::directory_entry& room : fs::directory_iterator(kSource / "core")) {
    if (!room.is_directory()) continue;
    const std::string name = room.path().filename();
    EXPECT_TRUE(rooms.contains(name)) << room.path();
    for (const fs::directory_entry& wing : fs::directory_iterator(room)) {
      if (!wing.is_directory()) continue;
      EXPECT_TRUE(WingsOf(name).contains(wing.path().filename())) << wing.path();
    }
  }
}

TEST(LayeringTest, NoArrowsGoInACircle) {
  std::vector<Arrows> drawn = {Rooms()};
  for (const auto& [room, included] : Rooms()) drawn.push_back(WingsOf(room));
  for (const Arrows& arrows : drawn) {
    for (const auto& [name, included] : arrows) EXPECT_FALSE(included.contains(name)) << name;
  }
}

TEST(LayeringTest, NoRoomIncludesAgainstTheArrows) {
  const Arrows rooms = Rooms();
  int includes = 0;
  ForEachInclude([&](const std::string& path, const std::string& header) {
    const std::string to = PlaceOf(header).room;
    if (to.empty() && !header.starts_with("tests/")) return;  // another library's
    ++includes;
    EXPECT_TRUE(Includes(rooms, PlaceOf(path).room, to)) << path << " includes " << header;
  });
  EXPECT_GT(includes, 500);
}

TEST(LayeringTest, NoWingIncludesAgainstTheArrows) {
  std::map<std::string, Arrows> wings;
  for (const auto& [room, included] : Rooms()) wings[room] = WingsOf(room);
  int includes = 0;
  ForEachInclude([&](const std::string& path, const std::string& header) {
    const Place from = PlaceOf(path), to = PlaceOf(header);
    if (from.room != to.room || wings[from.room].empty()) return;
    ++includes;
    if (to.wing == to.room && (header.ends_with("_options.h") || header.ends_with("/settings.h"))) {
      return;
    }
    EXPECT_TRUE(Includes(wings[from.room], from.wing, to.wing)) << path << " includes " << header;
  });
  EXPECT_GT(includes, 300);
}

}  // namespace
}  // namespace rilievo
