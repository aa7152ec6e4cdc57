#include "waymark/cli/localize_flags.hpp"

#include <CLI/App.hpp>

#include "waymark/cli/flags.hpp"
#include "waymark/cli/frame_flags.hpp"

namespace waymark::cli {
constexpr auto kThree = [](CLI::Option& option) { option.expected(3); };

void add_localize_flags(CLI::App& app, LocalizeJob& job) {
  add_option(app, "LOG", job.logs,
             "Recordings of one drive: MCAP, rosbag2, ROS 1, LCM, CSV tables; or a video; or a live camera: "
             "v4l2:/dev/video0. None with --robot KIND:ADDRESS");
  add_option(app, "--map FILE", job.map,
             "Map of the tags: map.yaml or its folder, apriltags_poses.yaml of the Robotics Academy, CSV "
             "with id, x, y, or a field layout of WPILib or Limelight",
             kRequired);
  add_option(app, "--robot NAME", job.robot,
             "Robot to localise while somebody else drives it, KIND:ADDRESS as `waymark teach` has it "
             "(ros2:limo, mbot:); or of a recording its camera and mounting: a robot's file, or a name. "
             "Unless given: the recording's, or those of robot.yaml beside the map");
  add_frame_flags(app, job.frames);
  add_option(app, "--calibration FILE", job.calibration, "Calibration of this robot (calibration.yaml)");
  add_option(
      app, "-o,--output FILE", job.output,
      "Record the estimates (.mcap), or write the certain ones as poses, one a line (.txt, .tum: TUM)");
  add_option(app, "--tag-size-m NUMBER", job.tag_size_m,
             "Tag size where the map has none (0.24 for the Academy's)");
  add_option(app, "--sensor-pose NUMBER", job.sensor_pose,
             "Mounting of the range sensor on the robot: x y [m], yaw [deg]", kThree);
  add_option(app, "--start NUMBER", job.start,
             "Initial pose of the robot, if it is known: x y [m], yaw [deg]", kThree);
}

}  // namespace waymark::cli
