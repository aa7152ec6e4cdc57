#include "waymark/app/localize/localize_kind.hpp"

#include <algorithm>

#include "waymark/app/common/camera_tags.hpp"
#include "waymark/app/live/camera_address.hpp"
#include "waymark/app/live/robot_kinds.hpp"

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

Result<LocalizeInput> localize_input(const LocalizeJob& job, const GivenFlags& given) {
  const Result<LocalizeInput> input = localize_kind(job, given("--camera"));
  if (!input) return input;
  const bool robot = *input == LocalizeInput::Robot;
  const bool camera = *input == LocalizeInput::Camera;
  const bool video = *input == LocalizeInput::Video;
  const char* leave_out = "Leave it out.";
  FlagRefusals refused(given);
  refused.flags(!robot,
                {"--robot-file", "--camera-source", "--detector", "--search-every", "--search-strips"},
                "this is about a robot that is there", "Add --robot KIND:ADDRESS.");
  refused.flags(!given("--search-every"), {"--search-strips"}, kSearchedWholly, kSearchEvery);
  refused.flags(!robot && !camera, {"--duration-s", "--record-images", "--view", "--publish-ros2"},
                "this is about a robot or a camera that is there", leave_out);
  refused.flags(*input == LocalizeInput::Recording, {"--every-s"},
                "this is about a robot, a camera or a video", leave_out);
  refused.flags(!camera && !video, {"--camera", "--camera-name", "--camera-size"},
                "this is about a live camera or a video", "--robot describes a robot's camera.");
  refused.flags(!video, {"--readout-ms"}, "this is about a video",
                "For a robot's camera it is --set filter.camera_readout_s=0.015.");
  refused.flags(*input != LocalizeInput::Recording,
                {"--no-adapt", "--base-frame", "--camera-frame", "--camera-topic", "--odometry-topic",
                 "--imu-topic", "--sensor-pose"},
                "this is about recordings", leave_out);
  refused.flags(camera || video, {"--robot", "--calibration", "--start", "--method"},
                "a camera without a robot is where the tags of one picture say", leave_out);
  refused.flags((robot || camera) && job.output.empty(), {"--record-images"}, "nothing is recorded",
                "Add -o FILE.mcap.");
  if (!refused.status()) return tl::unexpected(refused.status().error());
  return input;
}

}  // namespace waymark
