#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/byte_stream.h"
#include "core/codec/bytes/chunk.h"
#include "core/codec/container/colors.h"
#include "core/codec/heights/height_encoder.h"
#include "core/codec/heights/step_search.h"

namespace rilievo {
namespace {

constexpr size_t kChannels = 3;
// Search for the quantiser step that keeps the error: where it begins, in errors; how far off its
// end may be; trials.
constexpr double kFirstStep = 4, kClose = 0.06;
constexpr double kCoarser = 1.5, kCoarsestStep = 0.25;
constexpr int kMostTrials = 10;
// With bytes to keep: hardly a coefficient is left of any level.
constexpr double kNothingLeft = 4;

struct EncodedChannels {
  double step = 0;
  std::array<EncodedHeights, kChannels> channels;

  double rms() const {
    double sum = 0;
    for (const EncodedHeights& channel : channels) sum += channel.rms * channel.rms;
    return std::sqrt(sum / kChannels);
  }
};

int64_t BytesOf(const EncodedSurface& encoded) {
  int64_t bytes = 0;
  for (const auto& chunk : encoded.chunks) bytes += static_cast<int64_t>(chunk.size());
  return bytes;
}

Eigen::Vector3d Wide(const Rgb& color) {
  return Eigen::Vector3d(color[0], color[1], color[2]) / 255;
}

Eigen::Matrix3d CovarianceOf(const std::vector<Rgb>& colors) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Rgb& color : colors) mean += Wide(color);
  mean /= static_cast<double>(colors.size());
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Rgb& color : colors) {
    const Eigen::Vector3d off = Wide(color) - mean;
    sum += off * off.transpose();
  }
  return sum / static_cast<double>(colors.size());
}

// The principal axes of the colours, the longest first; an error along one is as large in red,
// green and blue together.
std::array<int8_t, 9> AxesOf(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  std::array<int8_t, 9> axes{};
  for (int k = 0; k < 3; ++k) {
    Eigen::Vector3d axis = solver.eigenvectors().col(2 - k);
    if (axis.sum() < 0) axis = -axis;
    for (int i = 0; i < 3; ++i) axes[3 * k + i] = static_cast<int8_t>(std::lround(127 * axis[i]));
  }
  return axes;
}

class ColorEncoder {
 public:
  // `file` and `refinement` must outlive it.
  static absl::StatusOr<ColorEncoder> Make(const DisplacedSurface& surface, const OpenedDss& file,
                                           const LoopRefinement& refinement,
                                           const RunContext& context) {
    ColorEncoder encoder;
    const Eigen::Matrix3d covariance = CovarianceOf(surface.colors);
    encoder.code_ = {{1, 1, 1}, AxesOf(covariance)};
    encoder.spread_ = std::sqrt(covariance.trace() / kChannels);
    const Eigen::Matrix3d numbers_from_rgb = encoder.code_.RgbFromNumbers().inverse();
    // A channel takes the place of the heights; no vertex is without.
    DisplacedSurface field;
    field.control_mesh = surface.control_mesh;
    field.max_level = surface.max_level;
    field.sources.assign(surface.colors.size(), HeightSource::kMeasured);
    field.heights.resize(surface.colors.size());
    const FaceGroups* groups = file.header.group_limit > 0 ? &file.groups : nullptr;
    for (int k = 0; k < 3; ++k) {
      for (size_t v = 0; v < surface.colors.size(); ++v) {
        field.heights[v] = static_cast<float>(numbers_from_rgb.row(k).dot(Wide(surface.colors[v])));
      }
      RILIEVO_RETURN_IF_ERROR(context.CheckStop());
      encoder.encoders_[k] = std::make_unique<HeightEncoder>(field, refinement, 1, groups);
    }
    return encoder;
  }

  // The same step for all channels: then a bit is worth as much in each.
  absl::StatusOr<EncodedChannels> Encode(double step, const RunContext& context) const {
    std::array<absl::StatusOr<EncodedHeights>, kChannels> encoded;
    RILIEVO_RETURN_IF_ERROR(ParallelFor(kChannels, 1, context, [&](int64_t begin, int64_t end) {
      for (int64_t k = begin; k < end; ++k) encoded[k] = encoders_[k]->Encode(step, context);
    }));
    EncodedChannels channels;
    channels.step = step;
    for (size_t k = 0; k < kChannels; ++k) {
      RILIEVO_ASSIGN_OR_RETURN(channels.channels[k], std::move(encoded[k]));
    }
    return channels;
  }

  // The coarsest found that keeps kColorError.
  absl::StatusOr<EncodedChannels> EncodeWithinError(const RunContext& context) const {
    double low = 0, high = 2 * kCoarsestStep, next = kFirstStep * kColorError;
    std::optional<EncodedChannels> best;
    for (int trial = 0; trial < kMostTrials || !best; ++trial) {
      RILIEVO_ASSIGN_OR_RETURN(EncodedChannels channels, Encode(next, context));
      const double share = channels.rms() / kColorError;
      if (share <= 1) {
        low = next;
        best = std::move(channels);
        if (share > 1 - kClose || next >= kCoarsestStep) break;
      } else {
        high = next;
      }
      if (low > 0 && high < (1 + kClose) * low) break;
      next = low == 0 ? high / kCoarser
             : high > kCoarsestStep
                 ? std::min(kCoarsestStep, low * std::max(kCoarser, std::min(4.0, 1 / share)))
                 : std::sqrt(low * high);
    }
    return *std::move(best);
  }

  const ColorCode& code() const { return code_; }
  // RMS error of one colour for all.
  double spread() const { return spread_; }

 private:
  ColorCode code_;  // units are those of the channels before they are coded
  double spread_ = 0;
  std::array<std::unique_ptr<HeightEncoder>, kChannels> encoders_;
};

// A chunk for each level.
std::vector<std::vector<uint8_t>> Chunks(const EncodedChannels& channels) {
  std::vector<std::vector<uint8_t>> chunks;
  for (size_t level = 0; level < channels.channels[0].layers.size(); ++level) {
    std::vector<uint8_t> payload;
    ByteWriter writer(payload);
    for (const EncodedHeights& channel : channels.channels) {
      writer.Varint(channel.layers[level].size());
      writer.Bytes(channel.layers[level]);
    }
    chunks.push_back(WrapChunk(kColorsTag, payload, false));
  }
  return chunks;
}

// The surface with its colours, each level's behind its heights, or behind those of the last level
// that has a chunk of them.
absl::StatusOr<EncodedSurface> WithColors(const EncodedChannels& channels, const ColorCode& code,
                                          const OpenedDss& file, EncodedSurface encoded) {
  DssMetadata metadata = file.header.metadata;
  metadata.colors = code;
  for (size_t k = 0; k < kChannels; ++k) metadata.colors.units[k] = channels.channels[k].unit;
  RILIEVO_RETURN_IF_ERROR(ReplaceMetadata(metadata, encoded));
  const auto last = static_cast<size_t>(file.header.layer_count());
  size_t level = 0;
  for (const std::vector<uint8_t>& chunk : Chunks(channels)) {
    std::vector<uint8_t>& before = encoded.chunks[std::min(++level, last)];
    before.insert(before.end(), chunk.begin(), chunk.end());
  }
  return encoded;
}

struct ColoredSurface {
  double step = 0, rms = 0;
  EncodedSurface encoded;
};

// What the colours are added to.
struct UncoloredSurface {
  const EncodedSurface& encoded;
  const OpenedDss& file;  // of its chunk 0
  const ColorEncoder& encoder;

  absl::StatusOr<ColoredSurface> With(const EncodedChannels& channels) const {
    RILIEVO_ASSIGN_OR_RETURN(EncodedSurface colored,
                             WithColors(channels, encoder.code(), file, encoded));
    return ColoredSurface{channels.step, channels.rms(), std::move(colored)};
  }

  // The finest colours found that take at most `room` bytes, where `finest` takes more; nullopt
  // where one colour for all would be as near.
  absl::StatusOr<std::optional<ColoredSurface>> WithinBytes(int64_t room,
                                                            const ColoredSurface& finest,
                                                            const RunContext& context) const {
    const int64_t bytes = BytesOf(encoded);
    const auto share = [&](const ColoredSurface& colored) {
      return static_cast<double>(BytesOf(colored.encoded) - bytes) / static_cast<double>(room);
    };
    StepSearch<ColoredSurface> search(
        [&](double step) -> absl::StatusOr<ColoredSurface> {
          RILIEVO_ASSIGN_OR_RETURN(const EncodedChannels channels, encoder.Encode(step, context));
          return With(channels);
        },
        share, false);
    RILIEVO_RETURN_IF_ERROR(search.Run(finest.step * share(finest), {finest.step, kNothingLeft}));
    const double most = std::max(kColorError, encoder.spread());
    if (!search.best() || search.best()->rms >= most) return std::nullopt;
    return std::move(search.best());
  }
};

}  // namespace

absl::StatusOr<CodedColors> AddColors(const DisplacedSurface& surface,
                                      std::optional<int64_t> max_bytes, const RunContext& context,
                                      EncodedSurface* encoded) {
  if (surface.colors.size() != surface.heights.size() || encoded->chunks.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(surface.colors.size(), " colours for ", surface.heights.size(), " vertices"));
  }
  const int64_t before = BytesOf(*encoded);
  if (max_bytes && *max_bytes <= before) return CodedColors();
  RILIEVO_ASSIGN_OR_RETURN(const OpenedDss file, OpenDss(encoded->chunks[0], true));
  RILIEVO_ASSIGN_OR_RETURN(
      const LoopRefinement refinement,
      RefineTopology(surface.control_mesh, std::max(0, surface.max_level - 1), context));
  RILIEVO_ASSIGN_OR_RETURN(const ColorEncoder encoder,
                           ColorEncoder::Make(surface, file, refinement, context));
  RILIEVO_ASSIGN_OR_RETURN(const EncodedChannels channels, encoder.EncodeWithinError(context));
  const UncoloredSurface plain{*encoded, file, encoder};
  RILIEVO_ASSIGN_OR_RETURN(std::optional<ColoredSurface> colored, plain.With(channels));
  if (max_bytes && BytesOf(colored->encoded) > *max_bytes) {
    RILIEVO_ASSIGN_OR_RETURN(colored, plain.WithinBytes(*max_bytes - before, *colored, context));
    if (!colored) return CodedColors();
  }
  *encoded = std::move(colored->encoded);
  return CodedColors{BytesOf(*encoded) - before, colored->rms};
}

}  // namespace rilievo
