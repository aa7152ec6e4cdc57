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

/// All inputs needed to render an image, so that another thread can do it.
struct CameraShot {
  SensorTime stamp{};                               ///< middle of the exposure, on the robot's clock
  std::shared_ptr<const World> world;               ///< world at that time
  SE3 map_T_base{};                                 ///< pose in the middle of the exposure
  Eigen::Vector3d twist = Eigen::Vector3d::Zero();  ///< in base axes: x, y [m/s], yaw [rad/s]
  std::uint64_t seed = 0;                           ///< seed for the noise in this image
  bool dark = false;                                ///< whether the lens is covered
  std::size_t camera = 0;                           ///< index of the camera on the robot
};

/// Output of the cameras.
enum class CameraOutput : std::uint8_t {
  Corners,  ///< TagFrames with simulated corners, without images
  Shots,    ///< CameraFrames without an image, and shot() for rendering it
};

/// A simulated robot in a world. next() advances the time to the next sample; a command takes effect as soon
/// as command() is called. Faults occur as scripted.
class SimulatedRobot final : public Robot {
 public:
  /// All cameras expose simultaneously.
  SimulatedRobot(World world, RobotModel model, std::vector<MountedCamera> cameras, const SE2& map_T_base,
                 const SimulatedRobotOptions& options, CameraOutput camera_output = CameraOutput::Corners);
  /// With one camera, mounted as in the model.
  SimulatedRobot(World world, RobotModel model, const CameraModel& camera, const SE2& map_T_base,
                 const SimulatedRobotOptions& options, CameraOutput camera_output = CameraOutput::Corners);

  /// The next sample. Never ends, because the simulation continues without limit.
  [[nodiscard]] Sample next();
  Status command(const VelocityCommand& command) override;

  /// The time on the clock used for timestamps; it may jump.
  [[nodiscard]] SensorTime now() const { return dynamics_.now() + clock_offset_; }
  /// Time since the start; never jumps.
  [[nodiscard]] Duration uptime() const { return dynamics_.now().time_since_epoch(); }
  /// The shot for the CameraFrame that was last returned by next().
  [[nodiscard]] const CameraShot& shot() const { return given_shot_; }
  /// The true pose, for simulated drivers only, never for an estimator.
  [[nodiscard]] const SE2& true_map_T_base() const { return dynamics_.map_T_base(); }

 private:
  /// A periodic sensor.
  struct Timer {
    Duration period{};
    SensorTime next{};
    bool due(SensorTime now);
  };
  /// A camera, its noise (not used for the first camera), and its last frame.
  struct CameraState {
    MountedCamera mounted;
    Random random;
    TagFrame last_frame{};
    CameraShot last_shot{};
  };
  void read_sensors();
  void take_image();
  void take_shot(std::size_t camera);
  void take_corners(std::size_t camera);
  void apply_faults();
  void apply_motion_fault(const Fault& fault, Grip& grip);
  void emit(Sample sample);
  /// Queues the sample after the latency of the camera.
  void emit_late(Sample sample);
  [[nodiscard]] bool fault_active(FaultKind kind) const;

  World true_world_;
  std::shared_ptr<const World> world_;  ///< true_world_ with the tag faults applied
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
  SE2 camera_base_ = SE2();  ///< pose of the base from which the cameras take their images
  std::vector<CameraState> cameras_;
  CameraShot given_shot_{};
  std::deque<CameraShot> shots_;
  std::uint64_t images_ = 0;
  std::deque<Sample> ready_;
  struct Late {
    Duration due{};  ///< due time, as uptime
    Sample sample;
  };
  std::deque<Late> late_;
  VelocityCommand command_{};
  Duration command_uptime_{};
};

}  // namespace waymark
