#include "waymark/cli/localize_flags.hpp"

#include <CLI/App.hpp>

#include "waymark/cli/frame_flags.hpp"

namespace waymark::cli {

void add_localize_flags(CLI::App& app, LocalizeJob& job) {
  app.add_option("LOG", job.logs,
                 "Recordings of one drive: MCAP, rosbag2, ROS 1, LCM, CSV tables; or a video; or a "
                 "live camera: v4l2:/dev/video0. None with --robot KIND:ADDRESS")
      ->type_name("");
  app.add_option("--map", job.map,
                 "Map of the tags: map.yaml or its folder, apriltags_poses.yaml of the Robotics Academy, CSV "
                 "with id, x, y, or a field layout of WPILib or Limelight")
      ->required()
      ->type_name("FILE");
  app.add_option("--robot", job.robot,
                 "Robot to localise while somebody else drives it, KIND:ADDRESS as `waymark teach` has it "
                 "(ros2:limo, mbot:); or of a recording its camera and mounting: a robot's file, "
                 "or a name. Unless given: the recording's, or those of robot.yaml beside the map")
      ->type_name("NAME");
  add_frame_flags(app, job.frames);
  app.add_option("--calibration", job.calibration, "Calibration of this robot (calibration.yaml)")
      ->type_name("FILE");
  app.add_option(
         "-o,--output", job.output,
         "Record the estimates (.mcap), or write the certain ones as poses, one a line (.txt, .tum: TUM)")
      ->type_name("FILE");
  app.add_option("--tag-size-m", job.tag_size_m, "Tag size where the map has none (0.24 for the Academy's)")
      ->type_name("NUMBER");
  app.add_option("--sensor-pose", job.sensor_pose,
                 "Mounting of the range sensor on the robot: x y [m], yaw [deg]")
      ->expected(3)
      ->type_name("NUMBER");
  app.add_option("--start", job.start, "Initial pose of the robot, if it is known: x y [m], yaw [deg]")
      ->expected(3)
      ->type_name("NUMBER");
}

}  // namespace waymark::cli
