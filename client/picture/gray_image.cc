#include "client/picture/gray_image.h"

#include "client/picture/png_bytes.h"
#include "core/base/status_macros.h"

namespace rilievo {

absl::StatusOr<std::string> EncodePng(const GrayImage& image) {
  RILIEVO_ASSIGN_OR_RETURN(std::string png, PngBytes(PngPixels::kGray16, image.width, image.height,
                                                     image.samples.data(), image.samples.size()));
  std::string texts;
  for (const auto& [keyword, text] : image.texts) {
    texts += PngChunk("tEXt", keyword + std::string(1, '\0') + text);
  }
  png.insert(kPngHeaderEnd, texts);
  return png;
}

}  // namespace rilievo
