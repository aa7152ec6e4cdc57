#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/robot.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/simulation/robot/simulated_robot_options.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {

/// A picture to be taken: everything a renderer needs, so that another thread may do it.
struct CameraShot {
  SensorTime stamp{};                               ///< middle of the exposure, by the robot's clock
  std::shared_ptr<const World> world;               ///< as it is at that moment
  SE3 map_T_base{};                                 ///< in the middle of the exposure
  Eigen::Vector3d twist = Eigen::Vector3d::Zero();  ///< of base in base axes: x, y [m/s], yaw [rad/s]
  std::uint64_t seed = 0;                           ///< of this picture's noise
  bool dark = false;                                ///< the lens is covered
  std::size_t camera = 0;                           ///< which of the robot's
};

/// What becomes of the cameras.
enum class CameraOutput : std::uint8_t {
  Corners,  ///< TagFrame: camera and detector in one, without pictures
  Shots,    ///< CameraFrame without a picture, and shot() says how to take it
};

/// A robot in a world. next() lets the time pass until the next sensor speaks; command() acts from then on.
/// Faults happen as their script says.
class SimulatedRobot final : public Robot {
 public:
  /// All cameras take their pictures at the same moments.
  SimulatedRobot(World world, RobotModel model, std::vector<MountedCamera> cameras, const SE2& map_T_base,
                 const SimulatedRobotOptions& options, CameraOutput camera_output = CameraOutput::Corners);
  /// With one camera, mounted as the model says.
  SimulatedRobot(World world, RobotModel model, const CameraModel& camera, const SE2& map_T_base,
                 const SimulatedRobotOptions& options, CameraOutput camera_output = CameraOutput::Corners);

  /// What its sensors say next. Never ends: the simulated world goes on.
  [[nodiscard]] Sample next();
  Status command(const VelocityCommand& command) override;

  /// Of the clock that stamps samples: it may jump.
  [[nodiscard]] SensorTime now() const { return dynamics_.now() + clock_offset_; }
  /// Since the robot was switched on: never jumps.
  [[nodiscard]] Duration uptime() const { return dynamics_.now().time_since_epoch(); }
  /// How to take the picture of the CameraFrame that next() gave last.
  [[nodiscard]] const CameraShot& shot() const { return given_shot_; }
  /// For a driver who stands beside the robot; never for an estimator.
  [[nodiscard]] const SE2& true_map_T_base() const { return dynamics_.map_T_base(); }

 private:
  /// A sensor that speaks at even times.
  struct Timer {
    Duration period{};
    SensorTime next{};
    bool due(SensorTime now);
  };
  /// A camera, its noise where it is not the first, and what it saw last.
  struct CameraState {
    MountedCamera mounted;
    Random random;
    TagFrame last_frame{};
    CameraShot last_shot{};
  };
  void speak();
  void take_picture();
  void look_with(std::size_t camera);
  void take_corners(std::size_t camera);
  void let_things_go_wrong();
  void suffer(const Fault& fault, Grip& grip);
  void say(Sample sample);
  /// Says it when the camera's latency is over.
  void say_later(Sample sample);
  [[nodiscard]] bool wrong(FaultKind kind) const;

  World true_world_;
  std::shared_ptr<const World> world_;  ///< with what has gone wrong
  RobotModel model_;
  SimulatedRobotOptions options_;
  Random random_;
  RobotDynamics dynamics_;
  MotionSensors sensors_;
  Timer camera_timer_;
  Timer odometry_timer_;
  Timer imu_timer_;
  Timer truth_timer_;
  Timer lidar_timer_;
  Lidar lidar_;
  Random lidar_random_;
  CameraOutput camera_output_;
  Duration clock_offset_{};
  double next_tag_change_s_ = 0;
  std::vector<bool> happened_;
  SE2 looks_from_ = SE2();  ///< where the robot was for the camera
  std::vector<CameraState> cameras_;
  CameraShot given_shot_{};
  std::deque<CameraShot> shots_;
  std::uint64_t pictures_ = 0;
  std::deque<Sample> ready_;
  struct Late {
    Duration due{};  ///< by uptime
    Sample sample;
  };
  std::deque<Late> late_;
  VelocityCommand command_{};
  Duration command_uptime_{};
};

}  // namespace waymark
