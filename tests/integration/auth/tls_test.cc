// Certificates on both sides, and plaintext only where nobody can listen in.
#include <filesystem>

#include "client/library/connect.h"
#include "client/library/status_conversion.h"
#include "tests/integration/auth/every_rpc.h"
#include "tests/integration/auth/test_certificates.h"
#include "tests/integration/jobs/jobs_fixture.h"

namespace rilievo {
namespace {

using testing::HasSubstr;

class TlsTest : public JobsTest {
 protected:
  void SetUp() override {
    certificates_.MakeAuthority("ca");
    certificates_.MakeAuthority("other-ca");
    certificates_.Make("ca", "server", "/CN=server");
  }

  std::vector<std::string> Tls() const {
    return {"--tls-cert", Path("server.pem"), "--tls-key", Path("server.key")};
  }
  std::vector<std::string> MutualTls() const {
    auto arguments = Tls();
    arguments.insert(arguments.end(), {"--tls-client-ca", Path("ca.pem")});
    return arguments;
  }

  std::string Path(const std::string& file) const { return certificates_.Path(file); }

  // A client that trusts `ca` and shows the certificate of that name, if any.
  JobsClient ClientOf(const std::string& name, const std::string& ca = "ca") const {
    ConnectOptions options{.ca = certificates_.Text(ca + ".pem")};
    if (!name.empty()) {
      options.certificate = certificates_.Text(name + ".pem");
      options.key = certificates_.Text(name + ".key");
    }
    return JobsClient(*Connect(address_, options), {.attempts = 1});
  }

  TestCertificates certificates_{&test_};
};

TEST_F(TlsTest, TheServerProvesItself) {
  StartServer(Tls());
  EXPECT_TRUE(ClientOf("").List(1).ok());
  EXPECT_TRUE(absl::IsUnavailable(ClientOf("", "other-ca").List(1).status())) << "unknown CA";
  EXPECT_TRUE(absl::IsUnavailable(HastyClient().List(1).status())) << "plaintext";
  EXPECT_EQ(RunProgram({RILIEVOD_PROGRAM, "--probe", address_}), 0);
  EXPECT_EQ(RunProgram({RILIEVO_PROGRAM, "jobs", "list", "--server", address_, "--tls-ca",
                        Path("ca.pem")}),
            0);
  daemon_->Signal(SIGTERM);
  daemon_->WaitForExit(std::chrono::seconds(10));
  EXPECT_EQ(RunProgram({RILIEVOD_PROGRAM, "--probe", address_}), 1);
}

TEST_F(TlsTest, AClientsNameIsThatOfItsCertificate) {
  certificates_.Make("ca", "alice", "/CN=alice");
  certificates_.Make("ca", "bob", "/CN=bob");
  certificates_.Make("ca", "nobody", "/O=nobody");
  certificates_.Make("other-ca", "mallory", "/CN=alice");
  auto arguments = MutualTls();
  arguments.insert(arguments.end(), {"--metrics", "127.0.0.1:0"});
  StartServer(arguments);
  const auto job = ClientOf("alice").Submit(PackScan(SphereScan(300)), {}, "one");
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_TRUE(ClientOf("alice").Watch(job->job_id()).ok());
  EXPECT_TRUE(absl::IsNotFound(ClientOf("bob").Get(job->job_id()).status()));
  EXPECT_EQ(ErrorReason(ClientOf("nobody").List(1).status()), "NO_CERTIFICATE");
  EXPECT_TRUE(absl::IsUnavailable(ClientOf("mallory").List(1).status())) << "of another authority";
  for (const auto& [rpc, status] :
       CallEveryRpc(*Connect(address_, {.ca = certificates_.Text("ca.pem")}))) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED) << rpc;
    EXPECT_EQ(ErrorReason(StatusFromGrpc(status)), "NO_CERTIFICATE") << rpc;
  }
  EXPECT_EQ(RunProgram({RILIEVOD_PROGRAM, "--probe", address_}), 0) << "health tells anybody";
  const auto line = daemon_->WaitForLine("metrics at ", std::chrono::seconds(10));
  ASSERT_TRUE(line.has_value());
  ASSERT_EQ(std::system(("curl -s --max-time 10 -o " + Path("metrics") + " " +
                         line->substr(line->find("http"), line->rfind('"') - line->find("http")))
                            .c_str()),
            0);
  EXPECT_THAT(FileText(Path("metrics")),
              HasSubstr("rilievo_refusals_total{reason=\"NO_CERTIFICATE\"}"));
}

TEST_F(TlsTest, ARenewedCertificateCountsWithoutARestart) {
  StartServer(Tls());
  ASSERT_TRUE(ClientOf("").List(1).ok());
  certificates_.Make("other-ca", "renewed", "/CN=server");
  for (const char* end : {".key", ".pem"}) {
    std::filesystem::rename(Path(std::string("renewed") + end), Path(std::string("server") + end));
  }
  absl::Status status;
  for (int i = 0; i < 100; ++i) {
    status = ClientOf("", "other-ca").List(1).status();
    if (status.ok()) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  EXPECT_TRUE(status.ok()) << status;
}

// The exit code, and what it says.
std::pair<int, std::string> Refusal(std::vector<std::string> arguments) {
  DaemonProcess daemon(arguments);
  const auto code = daemon.WaitForExit(std::chrono::seconds(20));
  std::string said;
  for (const auto& line : daemon.Log()) said += line + "\n";
  return {code.value_or(-1), said};
}

TEST_F(TlsTest, WrongFilesAreToldAtTheStart) {
  const auto refused = [&](const std::string& cert, const std::string& key) {
    const auto [code, said] = Refusal({"--tls-cert", Path(cert), "--tls-key", Path(key)});
    EXPECT_EQ(code, 1);
    return said;
  };
  EXPECT_THAT(refused("none.pem", "server.key"), HasSubstr("cannot be read"));
  EXPECT_THAT(refused("server.key", "server.key"), HasSubstr("holds no such PEM"));
  EXPECT_THAT(refused("server.pem", "ca.key"), HasSubstr("is not the key"));
  EXPECT_THAT(Refusal({"--tls-cert", Path("server.pem")}).second, HasSubstr("--tls-key"));
  EXPECT_THAT(Refusal({"--tls-client-ca", Path("ca.pem")}).second, HasSubstr("--tls-cert"));
}

TEST_F(TlsTest, PlaintextStaysOnThisMachineUnlessAskedFor) {
  const auto [code, said] = Refusal({"--listen", "0.0.0.0:0"});
  EXPECT_EQ(code, 1);
  EXPECT_THAT(said, HasSubstr("--tls-cert"));
  EXPECT_THAT(said, HasSubstr("--allow-plaintext"));
  for (const std::string& listen : {std::string("localhost:0"), "unix:" + (test_ / "socket")}) {
    DaemonProcess daemon({"--listen", listen});
    EXPECT_NE(daemon.address(), "") << listen;
    EXPECT_EQ(RunProgram({RILIEVOD_PROGRAM, "--probe", daemon.address()}), 0) << daemon.address();
  }
  DaemonProcess daemon({"--listen", "0.0.0.0:0", "--allow-plaintext"});
  const std::string port = daemon.address().substr(daemon.address().rfind(':'));
  EXPECT_EQ(RunProgram({RILIEVOD_PROGRAM, "--probe", "127.0.0.1" + port}), 0);
}

}  // namespace
}  // namespace rilievo
