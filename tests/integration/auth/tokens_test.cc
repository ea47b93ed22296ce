// Who has no token is refused, and each sees its own jobs alone.
#include <filesystem>
#include <fstream>

#include "client/library/connect.h"
#include "client/library/status_conversion.h"
#include "server/auth/access_tokens.h"
#include "server/auth/token_file.h"
#include "tests/integration/auth/every_rpc.h"
#include "tests/integration/jobs/jobs_fixture.h"

namespace rilievo {
namespace {

using testing::HasSubstr;

class TokensTest : public JobsTest {
 protected:
  void SetUp() override {
    for (const NewToken* token : {&alice_, &bob_}) {
      ASSERT_TRUE(AddTokenLine(test_ / "tokens", token->line).ok());
    }
    StartServer({"--tokens", test_ / "tokens"});
  }

  std::shared_ptr<grpc::ChannelInterface> ChannelWith(const std::string& token) const {
    return *Connect(address_, {.token = token});
  }
  JobsClient ClientWith(const std::string& token) const {
    return JobsClient(ChannelWith(token), {.attempts = 1});
  }

  const NewToken alice_ = *MakeToken("alice"), bob_ = *MakeToken("bob");
};

TEST_F(TokensTest, EveryRpcAsksForOne) {
  for (const std::string& token : {std::string(), alice_.token + "x", MakeToken("alice")->token}) {
    const auto ends = CallEveryRpc(ChannelWith(token));
    EXPECT_GT(ends.size(), 10u);
    for (const auto& [rpc, grpc_status] : ends) {
      const absl::Status status = StatusFromGrpc(grpc_status);
      EXPECT_EQ(status.code(), absl::StatusCode::kUnauthenticated) << rpc << ": " << status;
      EXPECT_EQ(ErrorReason(status), token.empty() ? "NO_TOKEN" : "WRONG_TOKEN") << rpc;
      EXPECT_THAT(std::string(status.message()), HasSubstr("token"));
    }
  }
  for (const auto& [rpc, status] : CallEveryRpc(ChannelWith(alice_.token))) {
    EXPECT_NE(status.error_code(), grpc::StatusCode::UNAUTHENTICATED) << rpc;
  }
  EXPECT_EQ(RunProgram({RILIEVOD_PROGRAM, "--probe", address_}), 0) << "but health";
}

TEST_F(TokensTest, AScanAndItsJobAreTheOwnersAlone) {
  const JobsClient alice = ClientWith(alice_.token), bob = ClientWith(bob_.token);
  const PackedScan scan = PackScan(SphereScan(500));
  const auto job = alice.Submit(scan, {}, "one");
  ASSERT_TRUE(job.ok()) << job.status();
  ASSERT_EQ(alice.Watch(job->job_id())->state(), v1::JOB_STATE_SUCCEEDED);
  const std::string& id = job->job_id();
  EXPECT_TRUE(absl::IsNotFound(bob.Get(id).status()));
  EXPECT_TRUE(absl::IsNotFound(bob.Watch(id).status()));
  EXPECT_TRUE(absl::IsNotFound(bob.Fetch(id).status()));
  EXPECT_TRUE(absl::IsNotFound(bob.Cancel(id).status()));
  v1::DeleteJobRequest request;
  request.set_job_id(id);
  v1::DeleteJobResponse response;
  grpc::ClientContext context;
  EXPECT_EQ(v1::JobsService::NewStub(ChannelWith(bob_.token))
                ->DeleteJob(&context, request, &response)
                .error_code(),
            grpc::StatusCode::NOT_FOUND);
  EXPECT_TRUE(bob.List(10)->empty());
  EXPECT_EQ(alice.List(10)->size(), 1u);
  EXPECT_TRUE(alice.Fetch(id).ok()) << "bob's cancel and delete did nothing";
  // The same words of a job that never was: nothing tells that this one is.
  EXPECT_EQ(bob.Get(id).status().message(), bob.Get("0123456789abcdef").status().message());
  // Who guesses the name of a scan has none of it, and is told as of one that is not there.
  v1::CreateJobRequest guess;
  guess.set_request_id("guess");
  guess.set_scan_id(scan.scan_id);
  guess.mutable_header()->set_point_count(scan.header.point_count());
  guess.mutable_header()->set_coordinate_format(scan.header.coordinate_format());
  const absl::Status guessed = bob.Create(guess).status();
  EXPECT_TRUE(absl::IsNotFound(guessed)) << guessed;
  guess.set_scan_id(std::string(64, '0'));
  EXPECT_EQ(guessed.message(), bob.Create(guess).status().message());
  const auto own = bob.Submit(scan, {}, "one");
  ASSERT_TRUE(own.ok()) << own.status();
  EXPECT_NE(own->job_id(), id) << "a request_id is its owner's too";
}

TEST_F(TokensTest, OwnersSurviveARestartAndTokensAreRevoked) {
  const auto job = ClientWith(alice_.token).Submit(PackScan(SphereScan(500)), {}, "one");
  ASSERT_TRUE(job.ok()) << job.status();
  KillServer();
  StartServer({"--tokens", test_ / "tokens"});
  EXPECT_TRUE(ClientWith(alice_.token).Watch(job->job_id()).ok());
  EXPECT_TRUE(absl::IsNotFound(ClientWith(bob_.token).Get(job->job_id()).status()));
  const NewToken next = *MakeToken("alice");
  std::ofstream(test_ / "tokens") << next.line << '\n';
  absl::Status old_token;
  for (int i = 0; i < 100 && !absl::IsUnauthenticated(old_token); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    old_token = ClientWith(alice_.token).Get(job->job_id()).status();
  }
  EXPECT_EQ(ErrorReason(old_token), "WRONG_TOKEN");
  EXPECT_TRUE(ClientWith(next.token).Get(job->job_id()).ok()) << "the owner is the name";
}

TEST_F(TokensTest, TheCommandLineShowsIt) {
  std::ofstream(test_ / "alice") << alice_.token << '\n';
  const std::vector<std::string> list = {RILIEVO_PROGRAM, "jobs", "list", "--server", address_};
  auto with = list;
  with.insert(with.end(), {"--token-file", test_ / "alice"});
  EXPECT_EQ(RunProgram(list), 4);
  EXPECT_EQ(RunProgram(with), 0);
  setenv("RILIEVO_TOKEN", bob_.token.c_str(), 1);
  EXPECT_EQ(RunProgram(list), 0);
  unsetenv("RILIEVO_TOKEN");
}

TEST(MakeTokenOption, PrintsTheTokenAndAddsItsLine) {
  TestFolder test;
  const std::string tokens = test / "tokens", out = test / "out";
  const std::string command =
      std::string(RILIEVOD_PROGRAM) + " --make-token carol --tokens " + tokens + " > " + out;
  ASSERT_EQ(std::system(command.c_str()), 0);
  std::string token;
  std::ifstream(out) >> token;
  const auto file = TokenFile::Open(tokens, {});
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ((*file)->OwnerOf(token), "carol");
  EXPECT_EQ(RunProgram({RILIEVOD_PROGRAM, "--make-token", "a b"}), 1);
  EXPECT_EQ(RunProgram({RILIEVOD_PROGRAM, "--tokens", test / "none"}), 1);
}

TEST(MakeTokenOption, WritesTheTokenForItsOwnerAlone) {
  TestFolder test;
  const std::string tokens = test / "tokens", out = test / "carol.token";
  const std::vector<std::string> make = {RILIEVOD_PROGRAM, "--make-token", "carol", "--tokens",
                                         tokens,           "--token-out",  out};
  ASSERT_EQ(RunProgram(make), 0);
  using std::filesystem::perms;
  EXPECT_EQ(std::filesystem::status(out).permissions(), perms::owner_read | perms::owner_write);
  std::string token;
  std::ifstream(out) >> token;
  EXPECT_EQ((*TokenFile::Open(tokens, {}))->OwnerOf(token), "carol");
  EXPECT_EQ(RunProgram(make), 1) << "a token that is in use is not written over";
  std::string unchanged;
  std::ifstream(out) >> unchanged;
  EXPECT_EQ(unchanged, token);
}

TEST(SecretFiles, TheServerWarnsOfThoseThatOthersMayRead) {
  TestFolder test;
  const std::string tokens = test / "tokens", store = test / "store";
  ASSERT_EQ(RunProgram({RILIEVOD_PROGRAM, "--make-token", "carol", "--tokens", tokens,
                        "--token-out", test / "token"}),
            0);
  const auto warnings = [&] {
    DaemonProcess daemon({"--tokens", tokens, "--store", store});
    EXPECT_NE(daemon.address(), "");
    std::string said;
    for (const std::string& line : daemon.Log()) {
      if (line.find("warning") != std::string::npos) said += line + "\n";
    }
    return said;
  };
  EXPECT_EQ(warnings(), "");
  const auto database = std::filesystem::status(store + "/jobs.db").permissions();
  EXPECT_EQ(database & std::filesystem::perms::others_all, std::filesystem::perms::none);
  EXPECT_EQ(database & std::filesystem::perms::group_all, std::filesystem::perms::none);
  std::filesystem::permissions(tokens, std::filesystem::perms(0644));
  std::filesystem::permissions(store, std::filesystem::perms(0755));
  const std::string said = warnings();
  EXPECT_THAT(said, testing::HasSubstr(tokens + " is open to all users"));
  EXPECT_THAT(said, testing::HasSubstr(store + " is open to all users"));
}

}  // namespace
}  // namespace rilievo
