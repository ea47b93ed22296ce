// A PostgreSQL of the test program alone: in a temporary folder, over a Unix socket, as a user
// without rights. It ends with the program.
#pragma once

#include <memory>
#include <string>

namespace rilievo {

class TestPostgres {
 public:
  // Started when it is first asked for. Null where Debian's postgresql-15 is not installed or does
  // not start; `why_not` says so then.
  static TestPostgres* Get(std::string* why_not);

  // URL of a new database without tables.
  std::string NewDatabase();

  // kill -9 of all its processes; then a new one on the same files.
  void Kill();
  void Start();

  ~TestPostgres();

 private:
  explicit TestPostgres(std::string folder) : folder_(std::move(folder)) {}

  std::string UrlOf(const std::string& database) const;
  // The program of PostgreSQL in the background; its number.
  int Launch(const std::string& program, const std::string& arguments) const;

  const std::string folder_;
  int server_ = -1;
  int databases_ = 0;
};

}  // namespace rilievo

// In the body of a test or of SetUp(): `server` is a TestPostgres*, or the test is skipped.
#define RILIEVO_TEST_POSTGRES(server)                                \
  std::string server##_why_not;                                      \
  TestPostgres* const server = TestPostgres::Get(&server##_why_not); \
  if (server == nullptr) GTEST_SKIP() << server##_why_not
