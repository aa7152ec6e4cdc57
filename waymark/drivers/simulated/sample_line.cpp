#include "waymark/drivers/simulated/sample_line.hpp"

#include <algorithm>
#include <utility>

namespace waymark {
namespace {

bool is_picture(const Sample& sample) { return std::holds_alternative<CameraFrame>(sample); }

}  // namespace

Result<std::unique_ptr<SampleLine>> SampleLine::make(const SimulatedStage& stage,
                                                     const LapListener& listener) {
  const auto threads = static_cast<std::size_t>(std::clamp(stage.threads, 1, 64));
  std::unique_ptr<PictureLine> pictures;
  if (stage.pictures) {
    const auto world = std::make_shared<const World>(stage.world);
    std::vector<std::unique_ptr<SceneEye>> eyes;
    for (std::size_t i = 0; i < threads; ++i) {
      auto eye =
          eyes.empty() ? SceneEye::make(world, stage.cameras(), *stage.pictures) : eyes.front()->another();
      if (!eye) return tl::unexpected(eye.error());
      eyes.push_back(std::move(*eye));
    }
    pictures = std::make_unique<PictureLine>(std::move(eyes));
  }
  return std::unique_ptr<SampleLine>(
      new SampleLine(std::move(pictures), threads > 1 ? threads : 0, listener));
}

Status SampleLine::pass_first() {
  Sample sample = std::move(waiting_.front());
  waiting_.pop_front();
  if (!is_picture(sample) || !pictures_) return listener_.on_sample(sample);
  auto seen = pictures_->pop();
  if (!seen) return tl::unexpected(seen.error());
  if (Status status = listener_.on_picture(*seen); !status) return status;
  return listener_.on_sample(seen->found);
}

Status SampleLine::add(Sample sample, const CameraShot& shot) {
  if (pictures_ && is_picture(sample)) pictures_->push(shot);
  waiting_.push_back(std::move(sample));
  while (!waiting_.empty()) {
    const bool on_its_way = pictures_ && is_picture(waiting_.front()) && !pictures_->ready();
    if (on_its_way && pictures_->pending() <= most_pending_) return {};
    if (Status status = pass_first(); !status) return status;
  }
  return {};
}

Status SampleLine::finish() {
  while (!waiting_.empty()) {
    if (Status status = pass_first(); !status) return status;
  }
  return {};
}

}  // namespace waymark
