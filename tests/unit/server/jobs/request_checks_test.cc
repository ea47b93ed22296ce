#include "server/jobs/request_checks.h"

#include <gtest/gtest.h>

namespace rilievo {
namespace {

TEST(RequestChecks, IdsAreShortAndPlain) {
  EXPECT_FALSE(CheckId("f", "aZ-_9").has_value());
  EXPECT_FALSE(CheckId("f", std::string(64, 'a')).has_value());
  for (const std::string& wrong :
       {std::string(), std::string(65, 'a'), std::string("a/b"), std::string(".."),
        std::string("a\0b", 3), std::string("\u00e9")}) {
    const auto error = CheckId("f", wrong);
    ASSERT_TRUE(error.has_value()) << wrong;
    EXPECT_EQ(error->violations.at(0).field, "f");
  }
}

TEST(RequestChecks, UploadsHaveLimits) {
  ServerOptions limits;
  limits.max_scan_bytes = 1000;
  v1::UploadHeader header;
  header.set_upload_id("a");
  EXPECT_EQ(CheckUploadHeader(header, limits)->violations.at(0).field, "header.total_bytes");
  header.set_total_bytes(1001);
  EXPECT_EQ(CheckUploadHeader(header, limits)->reason, ErrorCause::kLimitExceeded);
  header.set_total_bytes(~uint64_t{0});
  EXPECT_EQ(CheckUploadHeader(header, limits)->reason, ErrorCause::kLimitExceeded);
  header.set_total_bytes(1000);
  EXPECT_FALSE(CheckUploadHeader(header, limits).has_value());
  header.set_offset(1001);
  EXPECT_EQ(CheckUploadHeader(header, limits)->violations.at(0).field, "header.offset");
}

TEST(RequestChecks, ASumHasThirtyTwoBytes) {
  v1::UploadEnd end;
  std::string name;
  EXPECT_TRUE(ReadEnd(end, &name).has_value());
  std::string sum(32, '\xab');
  sum.back() = '\x01';
  end.set_sha256(sum);
  EXPECT_FALSE(ReadEnd(end, &name).has_value());
  EXPECT_EQ(name.substr(58), "abab01");
}

TEST(RequestChecks, PagesFollowEachOther) {
  v1::ListJobsRequest request;
  int limit = 0;
  int64_t before = -1;
  EXPECT_FALSE(ReadPage(request, &limit, &before).has_value());
  EXPECT_EQ(limit, 100);
  EXPECT_EQ(before, 0);
  request.set_page_token(PageToken(17));
  EXPECT_FALSE(ReadPage(request, &limit, &before).has_value());
  EXPECT_EQ(before, 17);
  EXPECT_EQ(PageToken(0), "");
  for (const char* wrong : {"x", "-1", "0", "99999999999999999999"}) {
    request.set_page_token(wrong);
    EXPECT_TRUE(ReadPage(request, &limit, &before).has_value()) << wrong;
  }
  request.clear_page_token();
  request.set_page_size(1001);
  EXPECT_TRUE(ReadPage(request, &limit, &before).has_value());
}

TEST(RequestChecks, TheStoresErrorsSayNothingOfTheMachine) {
  const CallError full = ErrorOfStore(absl::ResourceExhaustedError("/var/x: no space"));
  EXPECT_EQ(full.reason, ErrorCause::kStoreFull);
  EXPECT_TRUE(full.retry_delay.has_value());
  EXPECT_EQ(full.message.find("/var"), std::string::npos);
  const CallError broken = ErrorOfStore(absl::UnknownError("/var/x: broken"));
  EXPECT_EQ(broken.reason, ErrorCause::kStoreFailed);
  EXPECT_EQ(broken.message.find("/var"), std::string::npos);
  const CallError stated = ErrorOfStore(StatusOf({ErrorCause::kJobNotFound, "no such job"}));
  EXPECT_EQ(stated.reason, ErrorCause::kJobNotFound);
  EXPECT_EQ(stated.message, "no such job");
  EXPECT_EQ(ErrorOfStore(absl::NotFoundError("/var/x is not there")).reason,
            ErrorCause::kStoreFailed);
}

}  // namespace
}  // namespace rilievo
