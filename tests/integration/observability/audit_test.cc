// The audit lines of a server's log: who changed what, and who was refused.
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "client/library/connect.h"
#include "rilievo/v1/jobs.grpc.pb.h"
#include "server/auth/access_tokens.h"
#include "server/auth/token_file.h"
#include "tests/integration/auth/every_rpc.h"
#include "tests/integration/jobs/jobs_fixture.h"

namespace rilievo {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

class AuditTest : public JobsTest {
 protected:
  // Callers need the token of alice or of bob.
  void StartGuarded(std::vector<std::string> arguments = {}) {
    for (const NewToken* token : {&alice_, &bob_}) {
      ASSERT_TRUE(AddTokenLine(test_ / "tokens", token->line).ok());
    }
    arguments.insert(arguments.end(), {"--tokens", test_ / "tokens"});
    StartServer(arguments);
  }

  std::shared_ptr<grpc::ChannelInterface> ChannelOf(const std::string& token) const {
    return *Connect(address_, {.token = token});
  }
  JobsClient ClientOf(const std::string& token) const {
    return JobsClient(ChannelOf(token), {.attempts = 1});
  }

  // Of 500 points in the store, refused where `request_id` is wrong.
  static v1::CreateJobRequest JobOf(const PackedScan& scan, const std::string& request_id) {
    v1::CreateJobRequest request;
    request.set_request_id(request_id);
    request.set_scan_id(scan.scan_id);
    request.mutable_header()->set_point_count(scan.header.point_count());
    request.mutable_header()->set_coordinate_format(scan.header.coordinate_format());
    return request;
  }

  // Those so far, once there is one with `last` in it.
  std::vector<json> Audit(const std::string& last) const {
    EXPECT_TRUE(daemon_->WaitForLine(last, seconds(10)).has_value()) << last;
    std::vector<json> lines;
    for (const std::string& line : daemon_->Log()) {
      const json event = json::parse(line, nullptr, /*allow_exceptions=*/false);
      EXPECT_FALSE(event.is_discarded()) << line;
      if (event.value("event", "") == "audit") lines.push_back(event);
    }
    return lines;
  }

  // "CreateJob OK", of each line.
  static std::vector<std::string> Outcomes(const std::vector<json>& lines) {
    std::vector<std::string> outcomes;
    for (const json& line : lines) {
      outcomes.push_back(line["call"].get<std::string>() + " " +
                         line["outcome"].get<std::string>());
    }
    return outcomes;
  }

  const NewToken alice_ = *MakeToken("alice"), bob_ = *MakeToken("bob");
};

TEST_F(AuditTest, EachChangeLeavesALineWithItsOwnerAndWhatItChanged) {
  StartGuarded();
  const JobsClient alice = ClientOf(alice_.token);
  const PackedScan scan = PackScan(SphereScan(500)), other = PackScan(SphereScan(600));
  ASSERT_TRUE(alice.Upload(scan).ok());
  const auto job = alice.Create(JobOf(scan, "one"));
  ASSERT_TRUE(job.ok()) << job.status();
  const std::string& id = job->job_id();
  ASSERT_TRUE(alice.Watch(id).ok());
  ASSERT_TRUE(alice.Fetch(id).ok());
  ASSERT_TRUE(alice.List(10).ok());
  ASSERT_TRUE(alice.Cancel(id).ok());
  ASSERT_TRUE(alice.Delete(id).ok());
  ASSERT_TRUE(alice.Upload(other).ok());
  ASSERT_TRUE(alice.DeleteScan(other.scan_id).ok());
  const std::vector<json> lines = Audit("\"call\":\"DeleteScan\"");
  EXPECT_THAT(Outcomes(lines), ElementsAre("UploadScan OK", "CreateJob OK", "CancelJob OK",
                                           "DeleteJob OK", "UploadScan OK", "DeleteScan OK"));
  for (const json& line : lines) {
    EXPECT_EQ(line["owner"], "alice");
    EXPECT_THAT(line["peer"].get<std::string>(), StartsWith("ipv4:127.0.0.1:"));
    EXPECT_FALSE(line.contains("reason"));
    if (line["call"] == "UploadScan") {
      EXPECT_TRUE(line.contains("upload_id"));
    }
  }
  EXPECT_EQ(lines[0]["scan_id"], scan.scan_id);
  EXPECT_EQ(lines[1]["scan_id"], scan.scan_id);
  EXPECT_EQ(lines[1]["request_id"], "one");
  for (const size_t of_job : {1u, 2u, 3u}) EXPECT_EQ(lines[of_job]["job_id"], id);
  EXPECT_EQ(lines[5]["scan_id"], other.scan_id);
  const std::string secret = alice_.token.substr(alice_.token.find('.') + 1);
  for (const std::string& line : daemon_->Log()) EXPECT_THAT(line, Not(HasSubstr(secret)));
}

TEST_F(AuditTest, EachRefusalLeavesALineWithItsReason) {
  StartGuarded({"--max-calls", "1"});
  const PackedScan scan = PackScan(SphereScan(500));
  // Of a stranger, by calls that change something and that do not.
  EXPECT_FALSE(ClientOf("").Create(JobOf(scan, "one")).ok());
  EXPECT_FALSE(ClientOf("alice.wrong").Get("0f").ok());
  // Of owners.
  EXPECT_FALSE(ClientOf(alice_.token).Create(JobOf(scan, "no\nid")).ok());
  EXPECT_EQ(
      CallByName(ChannelOf(alice_.token), "/rilievo.v1.JobsService/DeleteJob", "\xff").error_code(),
      grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_FALSE(ClientOf(bob_.token).Delete("0123456789abcdef").ok());
  EXPECT_FALSE(ClientOf(bob_.token).Get("0123456789abcdef").ok()) << "which changes nothing";
  grpc::ClientContext context;
  v1::UploadScanResponse response;
  const auto open =
      v1::JobsService::NewStub(ChannelOf(alice_.token))->UploadScan(&context, &response);
  v1::UploadScanRequest header;
  header.mutable_header()->set_upload_id("open");
  header.mutable_header()->set_total_bytes(10);
  ASSERT_TRUE(open->Write(header));
  const auto start = steady_clock::now();
  while (std::filesystem::is_empty(test_ / "store/uploads") &&
         steady_clock::now() - start < seconds(10)) {
    std::this_thread::sleep_for(milliseconds(5));
  }
  EXPECT_FALSE(ClientOf(bob_.token).Upload(scan).ok()) << "one stream is what this server takes";
  open->WritesDone();  // before `end`
  EXPECT_FALSE(open->Finish().ok());

  const std::vector<json> lines = Audit("\"upload_id\":\"open\"");
  const auto find = [&](const std::string& call, const std::string& reason) {
    for (const json& line : lines) {
      if (line["call"] == call && line.value("reason", "") == reason) return line;
    }
    return json::object();
  };
  EXPECT_EQ(find("CreateJob", "NO_TOKEN").value("outcome", ""), "UNAUTHENTICATED");
  EXPECT_EQ(find("CreateJob", "NO_TOKEN").value("scan_id", ""), scan.scan_id);
  EXPECT_FALSE(find("CreateJob", "NO_TOKEN").contains("owner"));
  EXPECT_EQ(find("GetJob", "WRONG_TOKEN").value("outcome", ""), "UNAUTHENTICATED");
  EXPECT_EQ(find("CreateJob", "INVALID_FIELD").value("request_id", ""), "no\nid");
  EXPECT_EQ(find("CreateJob", "INVALID_FIELD").value("owner", ""), "alice");
  EXPECT_EQ(find("DeleteJob", "MALFORMED_MESSAGE").value("outcome", ""), "INVALID_ARGUMENT");
  EXPECT_EQ(find("DeleteJob", "JOB_NOT_FOUND").value("owner", ""), "bob");
  EXPECT_EQ(find("UploadScan", "CALLS_LIMIT").value("outcome", ""), "RESOURCE_EXHAUSTED");
  EXPECT_EQ(find("UploadScan", "SCAN_INCOMPLETE").value("upload_id", ""), "open");
  EXPECT_TRUE(find("GetJob", "JOB_NOT_FOUND").empty());
}

TEST_F(AuditTest, StrangersNeitherFillTheLogNorHideOthers) {
  StartGuarded();
  constexpr int kCalls = 400;
  const std::string path = "/rilievo.v1.JobsService/DeleteJob";
  const auto start = steady_clock::now();
  const auto channel = ChannelOf("");
  v1::DeleteJobRequest request;
  request.set_job_id(std::string(100'000, 'x'));
  for (int i = 0; i < kCalls; ++i) {
    CallByName(channel, path, i % 20 == 0 ? request.SerializeAsString() : "",
               "Bearer mallory.wrong");
  }
  EXPECT_FALSE(ClientOf(alice_.token).Delete("0123456789abcdef").ok());
  const double attacked = std::chrono::duration<double>(steady_clock::now() - start).count();
  std::this_thread::sleep_for(milliseconds(1100));
  CallByName(channel, "/rilievo.v1.JobsService/ListJobs");
  int written = 0, left_out = 0, of_alice = 0;
  for (const json& line : Audit("\"call\":\"ListJobs\"")) {
    EXPECT_LT(line.dump().size(), 400u);
    if (line.value("owner", "") == "alice") {
      ++of_alice;
    } else {
      ++written;
      left_out += std::stoi(line.value("left_out", "0"));
    }
  }
  EXPECT_EQ(of_alice, 1);
  EXPECT_LE(written, 5 * (2 + attacked));
  EXPECT_EQ(written + left_out, kCalls + 1) << "each is written or counted";
}

}  // namespace
}  // namespace rilievo
