#include "waymark/robots/simulated/sample_line.hpp"

#include <algorithm>
#include <utility>

namespace waymark {
namespace {

bool is_picture(const Sample& sample) { return std::holds_alternative<CameraFrame>(sample); }

}  // namespace

Result<std::unique_ptr<SampleLine>> SampleLine::make(const SimulatedSetup& setup,
                                                     const LapListener& listener) {
  const auto threads = static_cast<std::size_t>(std::clamp(setup.threads, 1, 64));
  std::unique_ptr<PictureLine> pictures;
  if (setup.pictures) {
    const auto world = std::make_shared<const World>(setup.world);
    std::vector<std::unique_ptr<DetectingCamera>> scene_cameras;
    for (std::size_t i = 0; i < threads; ++i) {
      auto scene_camera = scene_cameras.empty()
                              ? DetectingCamera::make(world, setup.cameras(), *setup.pictures)
                              : scene_cameras.front()->another();
      if (!scene_camera) return tl::unexpected(scene_camera.error());
      scene_cameras.push_back(std::move(*scene_camera));
    }
    pictures = std::make_unique<PictureLine>(std::move(scene_cameras));
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
