// Scans larger than memory, as people make surfaces of them.
#include <fstream>
#include <thread>

#include "client/cli/paged_scan_source.h"
#include "client/cli/parts_choice.h"
#include "core/codec/container/dss.h"
#include "core/codec/container/open_dss.h"
#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

class PartsTest : public ProgramFixture {
 protected:
  PartsTest() {
    EXPECT_EQ(Run({"simulate", "torus", "--points", "20000", "-o", At("scan.ply")}).code, 0);
    fs::create_directory(At("scratch"));
  }
  std::vector<std::string> Command(const std::string& output,
                                   const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all = {"reconstruct", At("scan.ply"), "--parts", "-o", At(output)};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  // Files of the run in the scratch folder.
  std::vector<std::string> Kept() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::recursive_directory_iterator(At("scratch"))) {
      names.push_back(entry.path().filename().string());
    }
    return names;
  }
};

TEST_F(PartsTest, AKilledRunGoesOnWhereItWas) {
  ASSERT_EQ(Run(Command("whole.dss")).code, 0);
  const std::vector<std::string> kept = Command("kept.dss", {"--scratch", At("scratch")});
  const pid_t child = Start(kept);
  for (int i = 0; i < 20000 && !::testing::Matches(::testing::Contains("coarse"))(Kept()); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  kill(child, SIGKILL);
  ASSERT_EQ(Wait(child).code, -SIGKILL) << "ended before it was killed";
  EXPECT_FALSE(fs::exists(At("kept.dss")));
  const Ended ended = Run(kept);
  EXPECT_EQ(ended.code, 0) << ended.err;
  EXPECT_THAT(ended.err, ::testing::Not(HasSubstr("control mesh"))) << "done again";
  EXPECT_EQ(Content(At("kept.dss")), Content(At("whole.dss")));
  EXPECT_THAT(Kept(), ::testing::IsEmpty());
}

TEST_F(PartsTest, PartsOfPagesThatAreNotThereAreNotUsed) {
  const auto load = [&] { return LoadPaged(At("scan.ply"), {}, {}, {At("scratch"), {}}, {}); };
  {
    const absl::StatusOr<PagedFile> paged = load();
    ASSERT_TRUE(paged.ok()) << paged.status();
    ASSERT_TRUE(paged->kept->folder().Save("coarse", {}).ok());
  }
  ASSERT_TRUE(load().ok());
  EXPECT_THAT(Kept(), ::testing::IsSupersetOf({"file", "coarse"}));
  fs::resize_file(fs::directory_iterator(At("scratch"))->path() / "file", 0);
  ASSERT_TRUE(load().ok());
  EXPECT_THAT(Kept(), ::testing::Contains("file"));
  EXPECT_THAT(Kept(), ::testing::Not(::testing::Contains("coarse")));
}

TEST_F(PartsTest, WhatTheyMakeIsVerifiedByParts) {
  const Ended asked = Run(Command("a.dss", {"--part-points", "16384", "--json"}));
  ASSERT_EQ(asked.code, 0) << asked.err;
  EXPECT_EQ(asked.out.find("not taken"), std::string::npos);
  const std::vector<std::string> verify = {"verify", At("a.dss"), At("scan.ply")};
  const auto with = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all = verify;
    all.insert(all.end(), more.begin(), more.end());
    return Run(all);
  };
  const Ended same = with({"--parts", "--scratch", At("scratch"), "--json"});
  EXPECT_EQ(same.code, 0) << same.err;
  EXPECT_THAT(same.err, HasSubstr("measure")) << "progress";
  const Json json = Json::parse(same.out);
  EXPECT_EQ(json["scan"], "same");
  EXPECT_THAT(std::string(json["options"]), HasSubstr("part_sizes=65536/16384/8192"));
  EXPECT_EQ(json["figures"].size(), 18u);
  EXPECT_GT(json["scan_to_surface"]["rms"], 0);
  EXPECT_THAT(Kept(), ::testing::IsEmpty());

  const Ended in_memory = with({});
  EXPECT_EQ(in_memory.code, 2);
  EXPECT_THAT(in_memory.err, HasSubstr("add --parts"));
  EXPECT_THAT(with({"--parts", "--classes", "2"}).err, HasSubstr("each point a class"));
  EXPECT_EQ(with({"--parts", "--scratch", At("nowhere")}).code, 6);
  EXPECT_THAT(with({"--scratch", At("scratch")}).err, HasSubstr("add that"));
  EXPECT_THAT(Run({"verify", At("a.dss"), "--parts"}).err, HasSubstr("name the scan"));
  EXPECT_EQ(Run({"verify", At("a.dss")}).code, 0);

  // Of somebody who wants much memory of whoever looks at it.
  const std::string content = Content(At("a.dss"));
  const std::vector<uint8_t> bytes(content.begin(), content.end());
  DecodedSurface decoded = *DecodeDss(bytes, {});
  std::string& options = decoded.metadata.options;
  options.replace(options.find("/16384/"), 7, "/1073741824/");
  EncodeOptions encode;
  encode.position_step = OpenDss(bytes, true)->header.position_step;
  const EncodedSurface foreign = *EncodeDss(decoded.surface, decoded.metadata, encode, {});
  const std::vector<uint8_t> written = foreign.Concatenate();
  std::ofstream(At("a.dss"))
      .write(reinterpret_cast<const char*>(written.data()),
             static_cast<std::streamsize>(written.size()));
  const Ended refused = with({"--parts"});
  EXPECT_EQ(refused.code, 3);
  EXPECT_THAT(refused.err, HasSubstr("1,073,741,824 points, which take"));
}

TEST_F(PartsTest, WhatCannotBeWrittenEndsWithSix) {
  const Ended ended = Run(Command("a.dss", {"--scratch", At("nowhere")}));
  EXPECT_EQ(ended.code, 6);
  EXPECT_THAT(ended.err, HasSubstr(At("nowhere")));
}

TEST_F(PartsTest, AfterALastingErrorNothingStays) {
  {
    std::ofstream line(At("scan.ply"));
    line << "ply\nformat ascii 1.0\nelement vertex 500\nproperty float x\nproperty float y\n"
            "property float z\nend_header\n";
    for (int i = 0; i < 500; ++i) line << i << " 0 0\n";
  }
  const Ended collinear = Run(Command("a.dss", {"--scratch", At("scratch")}));
  EXPECT_EQ(collinear.code, 3) << collinear.err;
  EXPECT_THAT(collinear.err, ::testing::Not(HasSubstr("the same command")));
  EXPECT_THAT(Kept(), ::testing::IsEmpty());
  std::ofstream(At("scan.ply")) << "0 0 0\n";
  EXPECT_EQ(Run(Command("a.dss", {"--scratch", At("scratch")})).code, 3);
  EXPECT_THAT(Kept(), ::testing::IsEmpty());
}

TEST_F(PartsTest, PartsThatWereNotAskedForAreWarnedOf) {
  // As few as take more memory than the smallest parts.
  ASSERT_EQ(Run({"simulate", "torus", "--points", "80000", "-o", At("more.ply")}).code, 0);
  const Ended ended = Run({"reconstruct", At("more.ply"), "-o", At("a.dss"), "--memory", "90MB",
                           "--part-points", "2048", "--max-level", "0", "--quiet", "--json"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  EXPECT_THAT(Json::parse(ended.out)["warnings"],
              ::testing::Contains(HasSubstr("its colours, stations, normals were not used")));
}

TEST_F(PartsTest, AScanThatFitsNeedsNoParts) {
  const auto fits = [&](int64_t memory) {
    return SizeOfScan(At("scan.ply"), {}, {}, memory, {})->fits();
  };
  EXPECT_TRUE(fits(2'000'000'000));
  EXPECT_TRUE(fits(0));
  EXPECT_FALSE(fits(25'000'000));
  EXPECT_TRUE(SizeOfScan("-", {}, {}, 1, {})->fits());
}

// How many points of a class there are nobody knows before: they are counted up to enough.
TEST_F(PartsTest, PointsThatAreChosenAreCountedAsFarAsNeeded) {
  constexpr int kMany = 40000;
  {
    std::ofstream file(At("classes.csv"));
    file << "x,y,z,classification\n";
    for (int i = 0; i < kMany; ++i) file << i % 200 << ',' << i / 200 << ",0," << 2 + i % 2 << '\n';
  }
  const auto size_of = [&](std::vector<int> classes, int64_t memory) {
    ScanArguments arguments;
    arguments.classes = std::move(classes);
    return SizeOfScan(At("classes.csv"), arguments, {}, memory, {}).value();
  };
  EXPECT_LT(size_of({2, 3}, 1).points, kMany);
  EXPECT_LT(size_of({2}, 1).points, kMany / 2);
  EXPECT_GT(size_of({2}, 1).points, kMany / 4);
  EXPECT_FALSE(size_of({2}, 1).fits());
}

TEST_F(PartsTest, MemoryThatIsNotEvenEnoughForPartsIsRefused) {
  const Ended ended = Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--memory", "25MB"});
  EXPECT_EQ(ended.code, 3);
  EXPECT_THAT(ended.err, HasSubstr("by parts"));
  EXPECT_THAT(ended.err, HasSubstr("25.0 MB may"));
  EXPECT_FALSE(fs::exists(At("a.dss")));
}

}  // namespace
}  // namespace rilievo
