// `rilievo update`: a new scan of a surface.
#include <cmath>

#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

class UpdateTest : public ProgramFixture {
 protected:
  // A wavy sheet, with a bump of this height in the middle.
  void WriteSheet(const std::string& name, double bump) const {
    std::ofstream out(At(name));
    for (int i = 0; i < 70; ++i) {
      for (int j = 0; j < 70; ++j) {
        const double x = i / 35.0 - 1, y = j / 35.0 - 1, away = (x * x + y * y) / 0.05;
        const double z = 0.1 * std::sin(2 * x) + bump * (away < 1 ? std::pow(1 - away, 2) : 0);
        out << x << ' ' << y << ' ' << z << '\n';
      }
    }
  }
  void SetUp() override {
    WriteSheet("old.xyz", 0);
    WriteSheet("new.xyz", 0.05);
    ASSERT_EQ(Run({"reconstruct", At("old.xyz"), "-o", At("old.dss"), "--quiet"}).code, 0);
  }
};

TEST_F(UpdateTest, TheFileThatWasThereIsTheBeginning) {
  const Ended made = Run({"update", At("old.dss"), At("new.xyz"), "-o", At("new.dss"), "--json"});
  ASSERT_EQ(made.code, 0) << made.err;
  const Json report = Json::parse(made.out);
  EXPECT_GT(report["points_contradicting"], 100);
  EXPECT_LT(report["heights_anew"], report["heights"].get<int>() / 2);
  EXPECT_LT(report["scan_to_surface"]["rms"].get<double>(),
            report["scan_to_surface_before"]["rms"].get<double>() / 5);
  const std::string before = Content(At("old.dss")), after = Content(At("new.dss"));
  EXPECT_EQ(after.substr(0, before.size()), before);
  EXPECT_EQ(after.size(), before.size() + report["update_bytes"].get<size_t>());
  const Ended seen = Run({"view", At("new.dss"), "-o", At("change.png"), "--colors", "change"});
  EXPECT_EQ(seen.code, 0) << seen.err;
  EXPECT_THAT(seen.out, HasSubstr("raised"));
  const Ended unchanged = Run({"view", At("old.dss"), "-o", At("c.png"), "--colors", "change"});
  EXPECT_EQ(unchanged.code, 2);
  EXPECT_THAT(unchanged.err, HasSubstr("has no updates"));
  // As a mesh, and once more without a change, in words.
  EXPECT_EQ(Run({"update", At("old.dss"), At("new.xyz"), "-o", At("new.ply")}).code, 0);
  EXPECT_EQ(Run({"compare", At("new.ply"), At("new.dss"), "--max-rms", "1e-6"}).code, 0);
  const Ended again = Run({"update", At("new.dss"), At("new.xyz"), "-o", At("same.dss")});
  EXPECT_THAT(again.out, HasSubstr("0 of 4"));
  EXPECT_EQ(Content(At("same.dss")), after);
}

TEST_F(UpdateTest, SaysWhatIsWrong) {
  const Ended same = Run({"update", At("old.dss"), At("new.xyz"), "-o", At("old.dss")});
  EXPECT_EQ(same.code, 2) << same.err;
  std::ofstream(At("far.xyz")) << "90 0 0\n91 0 0\n90 1 0\n";
  const Ended far = Run({"update", At("old.dss"), At("far.xyz"), "-o", At("t.dss")});
  EXPECT_EQ(far.code, 3);
  EXPECT_THAT(far.err, HasSubstr("(rilievo align)"));
}

}  // namespace
}  // namespace rilievo
