#include "client/formats/glb_clip.h"

#include <utility>

#include "absl/strings/str_cat.h"

namespace rilievo {
namespace {

constexpr char kTimes[] = "times", kWeights[] = "weights";

GlbColumn TargetColumn(const char* attribute, const Eigen::Matrix3Xf& added, int target) {
  GlbColumn column{attribute, kGlbFloat, "VEC3", static_cast<uint64_t>(added.cols()), 12};
  column.target = target;
  column.bytes = column.rows * 12;
  column.bounds = absl::StrCat(",\"min\":", GlbRow(added.rowwise().minCoeff().eval()),
                               ",\"max\":", GlbRow(added.rowwise().maxCoeff().eval()));
  column.write = [&added](BlockWriter* writer) {
    for (const float value : added.reshaped()) writer->Little(value);
  };
  return column;
}

template <typename Write>
GlbColumn AnimationColumn(const char* name, uint64_t rows, Write write) {
  GlbColumn column{name, kGlbFloat, "SCALAR", rows, 4};
  column.of_animation = true;
  column.bytes = rows * 4;
  column.write = std::move(write);
  return column;
}

}  // namespace

void AppendClipColumns(const GlbClip& clip, std::vector<GlbColumn>* columns) {
  const size_t targets = clip.frames.size();
  for (size_t t = 0; t < targets; ++t) {
    const GlbFrame& frame = clip.frames[t];
    columns->push_back(TargetColumn("POSITION", frame.moved, static_cast<int>(t)));
    if (frame.turned.cols() > 0) {
      columns->push_back(TargetColumn("NORMAL", frame.turned, static_cast<int>(t)));
    }
  }
  const auto time = [fps = clip.frames_per_second](size_t frame) {
    return static_cast<float>(static_cast<double>(frame) / fps);
  };
  columns->push_back(AnimationColumn(kTimes, targets + 1, [=](BlockWriter* writer) {
    for (size_t frame = 0; frame <= targets; ++frame) writer->Little(time(frame));
  }));
  std::string last;
  AppendNumber(time(targets), &last);
  columns->back().bounds = absl::StrCat(",\"min\":[0],\"max\":[", last, "]");
  columns->push_back(
      AnimationColumn(kWeights, (targets + 1) * targets, [targets](BlockWriter* writer) {
        for (size_t frame = 0; frame <= targets; ++frame) {
          for (size_t t = 0; t < targets; ++t) writer->Little(t + 1 == frame ? 1.0f : 0.0f);
        }
      }));
}

std::string GlbTargets(const std::vector<GlbColumn>& columns) {
  std::string targets;
  for (size_t i = 0, last = columns.size(); i < columns.size(); ++i) {
    if (columns[i].target < 0) continue;
    const bool is_new = last == columns.size() || columns[last].target != columns[i].target;
    if (is_new) absl::StrAppend(&targets, last == columns.size() ? ",\"targets\":[{" : "},{");
    absl::StrAppend(&targets, is_new ? "" : ",", "\"", columns[i].attribute, "\":", i);
    last = i;
  }
  return targets.empty() ? targets : targets + "}]";
}

std::string GlbAnimations(const std::vector<GlbColumn>& columns) {
  for (size_t i = 0; i + 1 < columns.size(); ++i) {
    if (!columns[i].of_animation) continue;
    return absl::StrCat(
        ",\"animations\":[{\"name\":\"cages\",\"channels\":[{\"sampler\":0,\"target\":{\"node\":1,"
        "\"path\":\"weights\"}}],\"samplers\":[{\"input\":",
        i, ",\"interpolation\":\"LINEAR\",\"output\":", i + 1, "}]}]");
  }
  return "";
}

}  // namespace rilievo
