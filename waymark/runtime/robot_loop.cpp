#include "waymark/runtime/robot_loop.hpp"

#include <algorithm>
#include <chrono>
#include <type_traits>
#include <utility>
#include <variant>

#include <fmt/format.h>

namespace waymark {

Pacing real_time() {
  return {.clock = [] {
    return std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now().time_since_epoch());
  }};
}

Pacing lockstep_time(std::function<Duration()> robots_clock) {
  return {.clock = std::move(robots_clock), .lockstep = true};
}

namespace {

const std::string* camera_of(const Sample& sample) {
  return std::visit(
      [](const auto& value) -> const std::string* {
        if constexpr (requires { value.camera; }) return &value.camera;
        return nullptr;
      },
      sample);
}

}  // namespace

bool FrameOrder::pass(const Sample& sample) {
  constexpr Duration kJump = std::chrono::seconds(1);
  const std::string* camera = camera_of(sample);
  if (camera == nullptr) return true;
  const SensorTime stamp = stamp_of(sample);
  const auto [entry, is_first] = newest_.try_emplace({sample.index(), *camera}, stamp);
  const Duration behind = entry->second - stamp;
  if (is_first || behind <= Duration(0) || behind > kJump) {
    entry->second = stamp;
    return true;
  }
  ++left_out_;
  if ((left_out_ & (left_out_ - 1)) == 0)
    words_ = fmt::format("{} of the camera '{}' skipped: stamped {:.3f} s before an earlier one",
                         left_out_ == 1 ? "1 image" : fmt::format("{} images", left_out_), *camera,
                         to_seconds(behind));
  return false;
}

void ImageQueue::push(CameraFrame image) {
  const auto older = std::ranges::find(waiting_, image.camera, &CameraFrame::camera);
  if (older == waiting_.end()) {
    waiting_.push_back(std::move(image));
    return;
  }
  *older = std::move(image);
  ++dropped_;
}

std::optional<CameraFrame> ImageQueue::pop() {
  if (waiting_.empty()) return std::nullopt;
  CameraFrame image = std::move(waiting_.front());
  waiting_.pop_front();
  return image;
}

RobotLoop::RobotLoop(Source& source, Robot& robot, Pacing pacing, ImageSearch search,
                     const RobotLoopOptions& options)
    : source_(source),
      robot_(robot),
      pacing_(std::move(pacing)),
      search_(std::move(search)),
      options_(options) {}

Status RobotLoop::receive(Sample sample, const RobotListener& listener) {
  if (!first_) first_ = stamp_of(sample);
  if (!order_.pass(sample)) {
    if (const auto words = order_.take_report()) listener.on_text(*words);
    return {};
  }
  robot_reports_commands_ = robot_reports_commands_ || std::holds_alternative<StampedCommand>(sample);
  auto* image = std::get_if<CameraFrame>(&sample);
  if (image == nullptr || search_.finder == nullptr) return listener.on_sample(sample);
  images_.push(std::move(*image));
  return {};
}

Duration RobotLoop::patience() const {
  if (!images_.empty()) return Duration(0);
  if (pacing_.lockstep) return options_.resend;
  return std::clamp(next_decision_ - uptime(), Duration(0), options_.period);
}

Status RobotLoop::take_event(const RobotListener& listener) {
  Result<std::optional<RobotEvent>> event = source_.next(patience());
  if (!event) return tl::unexpected(event.error());
  if (!*event) {  // in lockstep, this means that the response was lost
    return pacing_.lockstep && images_.empty() && !options_.listen_only ? robot_.command(last_) : Status();
  }
  if (const auto* text = std::get_if<RobotText>(&**event)) listener.on_text(text->text);
  if (std::holds_alternative<CommandRequest>(**event)) due_ = true;
  auto* sample = std::get_if<Sample>(&**event);
  return sample != nullptr ? receive(std::move(*sample), listener) : Status();
}

/// Searches the pending image if there is no other pending event. In lockstep every image is searched,
/// otherwise only the newest.
Status RobotLoop::search_image(const RobotListener& listener) {
  if (images_.empty() || (!pacing_.lockstep && source_.more())) return {};
  const CameraFrame frame = *images_.pop();
  if (Status status = listener.on_sample(frame); !status) return status;
  const MountedCamera* camera = find_camera(search_.cameras, frame.camera);
  TagSequence& sequence = sequences_.try_emplace(frame.camera, *search_.finder).first->second;
  const auto expected =
      camera != nullptr ? listener.expected(*camera, frame.stamp) : std::vector<ExpectedTag>();
  const ImageLens lens = camera != nullptr ? ImageLens::of(camera->camera) : ImageLens::unknown();
  auto found = sequence.find(frame.image, lens, expected);
  if (!found) {  // a single failure does not end the drive; if all searches fail, the age of the last image
                 // stops the robot
    listener.on_text("an image was skipped: " + to_string(found.error()));
    return {};
  }
  due_ = due_ || !pacing_.lockstep;
  if (!expected.empty()) listener.on_missed(std::move(found->missed));
  return listener.on_sample(TagFrame{frame.stamp, frame.camera, std::move(found->detections)});
}

Status RobotLoop::send(const VelocityCommand& command, SensorTime now, const RobotListener& listener) {
  if (options_.listen_only) return {};
  last_ = command;
  if (Status status = robot_.command(command); !status) return status;
  return robot_reports_commands_ ? Status() : listener.on_sample(StampedCommand{now, command});
}

Status RobotLoop::decide(const RobotListener& listener, RobotLoopEnd& end) {
  due_ = due_ || (!pacing_.lockstep && uptime() >= next_decision_);
  if (!std::exchange(due_, false)) return {};
  next_decision_ = uptime() + options_.period;
  const auto now = source_.now();
  if (!now && !pacing_.lockstep && to_seconds(uptime()) >= options_.first_sample_s)
    return fail(ErrorCode::NotFound,
                fmt::format("the robot has sent no sensor sample in {:g} s", options_.first_sample_s), {},
                "Check that its sensors and their drivers run; `waymark doctor robot=true` shows the data "
                "that it sends.");
  if (!now) return {};
  const Result<DriverDecision> decision = listener.decide(uptime(), *now);
  if (!decision) return tl::unexpected(decision.error());
  Status status = decision->pad ? listener.on_sample(*decision->pad) : Status();
  if (status) status = send(decision->command, *now, listener);
  end.done = status && decision->done;
  return status;
}

Status RobotLoop::run(const RobotListener& listener, RobotLoopEnd& end) {
  while (!end.done) {
    end.interrupted = listener.should_stop();
    end.timed_out = to_seconds(uptime()) >= options_.timeout_s;
    if (end.interrupted || end.timed_out) break;
    Status status = take_event(listener);
    if (status) status = search_image(listener);
    if (status) status = decide(listener, end);
    if (!status) return status;
  }
  end.interrupted = end.interrupted || listener.should_stop();  // also counts if the last decision ended the
                                                                // drive
  if (options_.listen_only || (end.done && !end.interrupted && last_ == VelocityCommand{})) return {};
  const Status sent = command_zero();
  if (!sent && !end.interrupted) return sent;  // after an interruption, the robot may have ended first
  const auto now = source_.now();
  return now ? listener.on_sample(StampedCommand{*now, {}}) : Status();
}

Status RobotLoop::command_zero() {
  if (options_.listen_only) return {};
  last_ = {};
  return robot_.command({});
}

Result<RobotLoopEnd> RobotLoop::drive(const RobotListener& listener) {
  began_ = pacing_.lockstep ? Duration(0) : pacing_.clock();
  next_decision_ = Duration(0);
  RobotLoopEnd end;
  const Status status = run(listener, end);
  if (!status) (void)command_zero();
  end.uptime = uptime();
  const auto now = source_.now();
  if (now && first_) end.seconds = to_seconds(*now - *first_);
  if (!options_.listen_only) robot_.finish();
  if (!status) return tl::unexpected(status.error());
  return end;
}

}  // namespace waymark
