#include "server/rpc/unread_message.h"

#include <gtest/gtest.h>

#include "rilievo/v1/jobs.pb.h"

namespace rilievo {
namespace {

TEST(UnreadMessage, ParsingAnythingTakesTheMarkAway) {
  v1::UploadScanRequest request;
  request.set_chunk("of the message before");
  MarkUnread(&request);
  EXPECT_TRUE(IsUnread(request));
  v1::UploadScanRequest sent;
  sent.set_chunk("bytes");
  for (const std::string& bytes : {sent.SerializeAsString(), std::string(), std::string("\xff\xff"),
                                   std::string("\x08\x01\xff", 3)}) {
    MarkUnread(&request);
    request.ParseFromString(bytes);
    EXPECT_FALSE(IsUnread(request)) << bytes.size();
  }
}

}  // namespace
}  // namespace rilievo
