#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/geometry/se2.hpp"
#include "waymark/simulation/world/world.hpp"

/// Faults in a robot and its world, injected by a script.
namespace waymark {

enum class FaultKind : std::uint8_t {
  CameraBlackout,  ///< frames arrive but are dark
  CameraFrozen,  ///< frames arrive with new timestamps, but all are equal to the last frame before the fault
  CameraLost,    ///< no frames
  OdometryLost,  ///< odometry and wheel samples stop; IMU samples continue
  TagMoved,      ///< a tag is moved to another position
  TagRemoved,
  TagDuplicated,  ///< a second tag has the number of an existing one
  TagsSwapped,    ///< two tags swap positions
  Kidnapped,      ///< the robot is instantly lifted and put down elsewhere
  ClockJump,      ///< the clock used by all sensors jumps permanently
  SlipBurst,      ///< the wheels turn more than the robot moves
  CameraStuck,  ///< frames arrive with new timestamps and fresh noise, but all from the last pose before the
                ///< fault
  WheelsBlocked,  ///< the wheels do not turn, regardless of commands
  RobotHeld,      ///< the robot does not move, but its wheels turn
  Carried,        ///< the robot is carried at constant speed for the duration of the fault
  BatterySag,     ///< the motors reach only a fraction of the commanded speed
};

struct Fault {
  FaultKind kind = FaultKind::CameraBlackout;
  double at_s = 0;                                         ///< time since the robot was switched on
  double for_s = std::numeric_limits<double>::infinity();  ///< duration; not used by instantaneous faults
  TagId tag{};                                             ///< only for the tag faults
  TagId other{};                                           ///< the tag that it is swapped with
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();       ///< TagMoved: translation in map axes
  double turn_rad = 0;                                     ///< TagMoved: rotation about map z
  SE3 map_T_copy{};                                        ///< TagDuplicated: pose of the second tag
  SE2 base_T_put = SE2();                                  ///< Kidnapped: relative to the previous pose
  Eigen::Vector3d carry = Eigen::Vector3d::Zero();         ///< Carried: x, y [m/s] and yaw [rad/s] in base
  double jump_s = 0;                                       ///< ClockJump: positive is forward
  double speed_share = 1;                                  ///< SlipBurst, BatterySag: fraction of the speed
  double yaw_share = 1;                                    ///< SlipBurst: fraction of the yaw rate
};

/// Names used in a faults file, such as "camera_blackout".
[[nodiscard]] std::span<const std::pair<FaultKind, std::string_view>> fault_names();

/// Whether a fault is active. A clock jump stays active; a kidnapping is never active.
[[nodiscard]] bool active(const Fault& fault, double now_s);
/// Whether any fault of the given kind is active.
[[nodiscard]] bool active(std::span<const Fault> faults, FaultKind kind, double now_s);

/// The world with the active tag faults applied in order. O(tags).
[[nodiscard]] World with_tag_faults(const World& world, std::span<const Fault> faults, double now_s);
/// The next time at which the result of with_tag_faults() changes; infinite if it never does.
[[nodiscard]] double next_tag_change_s(std::span<const Fault> faults, double now_s);

/// Fails if a fault refers to an unknown tag or has an invalid time or fraction.
[[nodiscard]] Status check(std::span<const Fault> faults, const World& world);

}  // namespace waymark
