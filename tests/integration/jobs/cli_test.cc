// rilievo jobs, as people type it.
#include <cstdio>
#include <fstream>
#include <iterator>

#include "absl/strings/str_cat.h"
#include "tests/integration/jobs/jobs_fixture.h"

namespace rilievo {
namespace {

std::string Content(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

class JobsCommandTest : public JobsTest {
 protected:
  // Standard output; *code is the exit code.
  std::string Rilievo(const std::string& arguments, int* code) {
    const std::string command = absl::StrCat(RILIEVO_PROGRAM, " ", arguments, " 2>/dev/null");
    std::FILE* pipe = popen(command.c_str(), "r");
    std::string out;
    char buffer[4096];
    for (size_t n; (n = fread(buffer, 1, sizeof(buffer), pipe)) > 0;) out.append(buffer, n);
    *code = WEXITSTATUS(pclose(pipe));
    return out;
  }

  // The value of a line "name  value" of `jobs show` and its like.
  static std::string JobId(const std::string& out) {
    return out.substr(4, out.find(':') - 4);  // "job ID: queued"
  }
};

void WritePoints(const PointCloud& scan, const std::string& path) {
  std::ofstream file(path);
  file.precision(17);
  for (const auto point : scan.points.colwise()) file << point.transpose() << '\n';
}

// By the command's own process, by a server, and as a kept job.
TEST_F(JobsCommandTest, ASurfaceIsBroughtUpToDateEverywhereTheSame) {
  StartServer();
  PointCloud scan = SphereScan(2'000);
  WritePoints(scan, test_ / "old.xyz");
  for (auto point : scan.points.colwise()) {
    if (point[2] > 0.8) point *= 1.02;
  }
  WritePoints(scan, test_ / "new.xyz");
  const std::string server = " --server " + address_, old = test_ / "old.dss";
  const auto run = [&](const std::string& arguments) {
    int code = -1;
    Rilievo(arguments, &code);
    EXPECT_EQ(code, 0) << arguments;
  };
  run("reconstruct " + (test_ / "old.xyz") + " -o " + old);
  run("update " + old + " " + (test_ / "new.xyz") + " -o " + (test_ / "here.dss"));
  run("update " + old + " " + (test_ / "new.xyz") + server + " -o " + (test_ / "there.dss"));
  run("jobs submit " + (test_ / "new.xyz") + server + " --base " + old + " -o " +
      (test_ / "job.dss"));
  const std::string updated = Content(test_ / "here.dss");
  EXPECT_GT(updated.size(), Content(old).size());
  EXPECT_EQ(Content(test_ / "there.dss"), updated);
  EXPECT_EQ(Content(test_ / "job.dss"), updated);
  int code = 0;
  Rilievo("jobs submit " + (test_ / "new.xyz") + server + " --base " + old + " --max-level 2",
          &code);
  EXPECT_EQ(code, 2) << "a surface keeps the options it was made with";
}

TEST_F(JobsCommandTest, FromAFileToAFile) {
  StartServer();
  const PointCloud scan = SphereScan(3'000);
  WritePoints(scan, test_ / "scan.xyz");
  const std::string server = " --server " + address_;
  int code = -1;
  const std::string submitted =
      Rilievo("jobs submit " + (test_ / "scan.xyz") + server + " --request-id one", &code);
  ASSERT_EQ(code, 0) << submitted;
  const std::string id = JobId(submitted);
  EXPECT_THAT(Rilievo("jobs watch " + id + server, &code), testing::HasSubstr("succeeded"));
  EXPECT_EQ(code, 0);
  Rilievo("jobs fetch " + id + server + " -o " + (test_ / "a.dss"), &code);
  EXPECT_EQ(code, 0);
  const auto expected = Expected(scan);
  EXPECT_EQ(Content(test_ / "a.dss"), std::string(expected.begin(), expected.end()));
  // The same request again, with the surface at once.
  Rilievo(
      "jobs submit " + (test_ / "scan.xyz") + server + " --request-id one -o " + (test_ / "b.dss"),
      &code);
  EXPECT_EQ(code, 0);
  EXPECT_EQ(Content(test_ / "a.dss"), Content(test_ / "b.dss"));
  // As a mesh, by every road through a server.
  Rilievo("export " + (test_ / "a.dss") + " " + (test_ / "expected.glb"), &code);
  Rilievo("jobs fetch " + id + server + " -o " + (test_ / "a.glb") + " --keep-dss", &code);
  EXPECT_EQ(code, 0);
  EXPECT_EQ(Content(test_ / "a.glb"), Content(test_ / "expected.glb"));
  Rilievo(
      "jobs submit " + (test_ / "scan.xyz") + server + " --request-id one -o " + (test_ / "b.glb"),
      &code);
  EXPECT_EQ(Content(test_ / "b.glb"), Content(test_ / "expected.glb"));
  Rilievo("reconstruct " + (test_ / "scan.xyz") + server + " --keep-dss -o " + (test_ / "c.glb"),
          &code);
  EXPECT_EQ(code, 0);
  EXPECT_EQ(Content(test_ / "c.glb"), Content(test_ / "expected.glb"));
  EXPECT_EQ(Content(test_ / "c.dss"), Content(test_ / "a.dss"));
  Rilievo("jobs fetch " + id + server + " -o " + (test_ / "a.foo"), &code);
  EXPECT_EQ(code, 2);
  EXPECT_THAT(Rilievo("jobs list" + server, &code), testing::HasSubstr(id));
  EXPECT_THAT(Rilievo("jobs show " + id + server + " --json", &code),
              testing::HasSubstr("\"state\": \"succeeded\""));
  Rilievo("jobs cancel " + id + server, &code);
  EXPECT_EQ(code, 0) << "a finished job stays as it is";
  Rilievo("jobs delete " + id + server, &code);
  EXPECT_EQ(code, 0);
  Rilievo("jobs show " + id + server, &code);
  EXPECT_NE(code, 0);
  EXPECT_EQ(Rilievo("jobs list" + server, &code), "");
}

TEST_F(JobsCommandTest, AMeshIsConverted) {
  StartServer();
  int code = -1;
  Rilievo("simulate torus --points 3000 -o " + (test_ / "torus.ply"), &code);
  Rilievo("reconstruct " + (test_ / "torus.ply") + " --quiet -o " + (test_ / "torus.dss"), &code);
  Rilievo("export " + (test_ / "torus.dss") + " " + (test_ / "torus.obj") + " --level 1", &code);
  ASSERT_EQ(code, 0);
  const std::string server = " --server " + address_, mesh = test_ / "torus.obj";
  Rilievo("jobs convert " + mesh + server + " --control-faces 100 --max-error 0.1% -o " +
              (test_ / "kept.dss"),
          &code);
  EXPECT_EQ(code, 0);
  Rilievo("convert " + mesh + server + " --control-faces 100 --max-error 0.1% -o " +
              (test_ / "direct.dss"),
          &code);
  EXPECT_EQ(code, 0);
  EXPECT_EQ(Content(test_ / "kept.dss"), Content(test_ / "direct.dss"));
  Rilievo("jobs convert " + (test_ / "torus.ply") + server, &code);
  EXPECT_EQ(code, 3) << "points alone";
}

TEST_F(JobsCommandTest, WrongCommandsAreUsageErrors) {
  int code = -1;
  Rilievo("jobs", &code);
  EXPECT_EQ(code, 2);
  Rilievo("jobs show x", &code);
  EXPECT_EQ(code, 2) << "no server";
  Rilievo("jobs show x --server 127.0.0.1:1 --timeout 0.5", &code);
  EXPECT_EQ(code, 4);
}

}  // namespace
}  // namespace rilievo
