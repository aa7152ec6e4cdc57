#include "waymark/app/live/camera_watch.hpp"

#include <optional>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include "waymark/app/common/camera_description.hpp"
#include "waymark/app/live/system_stamps.hpp"

namespace waymark {
namespace {

constexpr Duration kWatchSlice = std::chrono::milliseconds(100);
constexpr Duration kClockPeriod = std::chrono::seconds(1);
constexpr Duration kCameraSilence = std::chrono::seconds(10);

/// One run of watch_camera().
class Watcher {
 public:
  Watcher(LiveCamera& camera, const TagFinder& finder, const CameraWatch& watch)
      : camera_(camera), finder_(finder), watch_(watch), last_heard_(stamps_.now()) {}

  Result<CameraWatchEnd> run() {
    while (!over()) {
      const Result<bool> went_on = step();
      if (!went_on) return tl::unexpected(went_on.error());
    }
    end_.counts = camera_.counts();
    if (first_) end_.seconds = to_seconds(last_ - *first_);
    return end_;
  }

 private:
  [[nodiscard]] bool over() {
    end_.stopped = watch_.should_stop();
    return end_.stopped || camera_.ended() || (first_ && to_seconds(last_ - *first_) >= watch_.duration_s);
  }

  Result<bool> step() {
    look_at_clock();
    auto event = camera_.next(kWatchSlice);
    if (!event) return tl::unexpected(event.error());
    if (!*event) return silent();
    last_heard_ = stamps_.now();
    if (const auto* said = std::get_if<RobotText>(&**event)) watch_.on_words(said->text);
    auto* sample = std::get_if<Sample>(&**event);
    auto* frame = sample != nullptr ? std::get_if<CameraFrame>(sample) : nullptr;
    if (frame == nullptr) return true;
    const Status seen = take(std::move(*frame));
    return seen ? Result<bool>(true) : tl::unexpected(seen.error());
  }

  Result<bool> silent() const {
    if (stamps_.now() - last_heard_ < kCameraSilence) return true;
    return fail(ErrorCode::Unreadable, "the camera delivers no pictures", {.source = camera_.description()},
                "Check its cable; `waymark cameras` lists what there is.");
  }

  Status take(CameraFrame frame) {
    frame.stamp = stamps_.at(frame.stamp);
    const ImageView view = frame.image;
    if (watch_.camera != nullptr)
      if (Status fits = check_picture_size(*watch_.camera, view.width, view.height); !fits) return fits;
    auto found = find_tags(view, finder_, watch_.camera);
    if (!found) return tl::unexpected(found.error());
    CameraPicture seen{std::move(frame), std::move(*found), {}};
    seen.age = stamps_.now() - seen.frame.stamp;
    if (!first_) first_ = seen.frame.stamp;
    last_ = seen.frame.stamp;
    ++end_.pictures;
    end_.tags += seen.found.detections.size();
    return watch_.on_picture(seen);
  }

  void look_at_clock() {
    if (stamps_.now() < next_look_) return;
    next_look_ = stamps_.now() + kClockPeriod;
    if (const auto jump = stamps_.take_jump()) watch_.on_words(*jump);
  }

  LiveCamera& camera_;
  const TagFinder& finder_;
  const CameraWatch& watch_;
  SystemStamps stamps_{};
  SensorTime last_heard_;
  SensorTime next_look_{};
  std::optional<SensorTime> first_{};
  SensorTime last_{};
  CameraWatchEnd end_{};
};

}  // namespace

Result<CameraWatchEnd> watch_camera(LiveCamera& camera, const TagFinder& finder, const CameraWatch& watch) {
  return Watcher(camera, finder, watch).run();
}

}  // namespace waymark
