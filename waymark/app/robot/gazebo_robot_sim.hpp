#pragma once

#include <string>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/robot/plant.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/robots/gazebo/gazebo_link.hpp"
#include "waymark/robots/gazebo/profile.hpp"

namespace waymark {

struct GazeboSimOptions {
  std::string profile{};  ///< name or path of a .yaml file

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.profile, JobField("gazebo PROFILE", "Names of the topics: limo, or the path of a .yaml file")
                            .input()
                            .also("gazebo")
                            .required());
  }
};

/// Runs a plant with this camera on the Gazebo network until cancelled. Publishes the topics in the profile
/// (images, calibration, odometry, IMU, lidar, poses, clock) and obeys the commands. Messages are timestamped
/// with simulated time, which runs at most as fast as real time. As in Gazebo, a command is valid until the
/// next one, so the plant has no watchdog.
[[nodiscard]] Status run_gazebo_robot_sim(GazeboLink& link, const GazeboProfile& profile, Plant& plant,
                                          const CameraModel& camera, const JobControl& control);

}  // namespace waymark
