#include "waymark/live/localize_kind.hpp"

#include <algorithm>

#include "waymark/jobs/camera_tags.hpp"
#include "waymark/live/camera_address.hpp"
#include "waymark/live/robot_kinds.hpp"

namespace waymark {
namespace {

LocalizeInput kind_of(const LocalizeJob& job, bool calibrated) {
  if (is_robot_kind(job.robot)) return LocalizeInput::Robot;
  if (std::ranges::any_of(job.logs, is_camera_address)) return LocalizeInput::Camera;
  const auto filmed = [&](const std::string& log) { return is_of_camera(log, calibrated); };
  return std::ranges::any_of(job.logs, filmed) ? LocalizeInput::Video : LocalizeInput::Recording;
}

}  // namespace

Result<LocalizeInput> localize_kind(const LocalizeJob& job, bool calibrated) {
  const LocalizeInput input = kind_of(job, calibrated);
  const bool robot = input == LocalizeInput::Robot;
  if (robot && !job.logs.empty())
    return fail(ErrorCode::InvalidArgument,
                "a robot that is there is localised, and a recording is named, too",
                {.source = job.logs.front()}, "Leave one of them out; --robot NAME describes a robot.");
  if (input == LocalizeInput::Camera && job.logs.size() > 1)
    return fail(ErrorCode::InvalidArgument, "a live camera is the only input", {},
                "Run the program once for each camera.");
  if (input == LocalizeInput::Video && job.logs.size() > 1)
    return fail(ErrorCode::InvalidArgument, "a video is the only input", {.source = job.logs[1]},
                "Run the program once for each video.");
  if (!robot && job.logs.empty())
    return fail(ErrorCode::InvalidArgument, "there is nothing to localise", {},
                "Name a recording, or a robot that is there: --robot ros2:limo.");
  return input;
}

}  // namespace waymark
