#include "client/formats/file_kind.h"

#include <gtest/gtest.h>

namespace rilievo {
namespace {

TEST(FileKindTest, ContentSpeaksBeforeTheName) {
  EXPECT_EQ(RecognizeFile("ply\nformat ascii 1.0\n", 0, "scan.xyz").value(), FileKind::kPly);
  EXPECT_EQ(RecognizeFile("LASF", 0, "-").value(), FileKind::kLas);
  EXPECT_EQ(RecognizeFile("ASTM-E57", 0, "scan.xyz").value(), FileKind::kE57);
}

TEST(FileKindTest, RowsOfNumbersNeedNoName) {
  EXPECT_EQ(RecognizeFile("1,2,3\n4,5,6\n", 0, "-").value(), FileKind::kXyz);
  EXPECT_EQ(RecognizeFile(" ; 1 2 3\n", 0, "-").value(), FileKind::kXyz);
}

TEST(FileKindTest, RowsOfSeparatorsAreNoNumbers) {
  for (const char* head : {",,,\n1,2,3\n", ";", " \t;;\r\n"}) {
    EXPECT_EQ(RecognizeFile(head, 0, "-").status().code(), absl::StatusCode::kInvalidArgument)
        << head;
  }
}

TEST(FileKindTest, NothingIsNoFile) {
  EXPECT_EQ(RecognizeFile("", 0, "scan.ply").status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace rilievo
