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

/// Faults of a robot and its world, injected by a script.
namespace waymark {

enum class FaultKind : std::uint8_t {
  CameraBlackout,  ///< frames arrive but are dark
  CameraFrozen,    ///< frames arrive with new stamps, all equal to the last frame before the fault
  CameraLost,      ///< no frames
  OdometryLost,    ///< odometry and wheel samples stop; IMU samples continue
  TagMoved,        ///< a tag is at another position
  TagRemoved,
  TagDuplicated,  ///< a second tag has an existing number
  TagsSwapped,    ///< two tags exchange their positions
  Kidnapped,      ///< the robot is lifted and put down elsewhere, instantly
  ClockJump,      ///< the clock of all sensors jumps permanently
  SlipBurst,      ///< the wheels turn more than the robot moves
  CameraStuck,    ///< frames arrive with new stamps and fresh noise, all from the last pose before the fault
  WheelsBlocked,  ///< the wheels do not turn, regardless of commands
  RobotHeld,      ///< the robot does not move, its wheels turn
  Carried,        ///< the robot is carried at constant speed while the fault lasts
  BatterySag,     ///< the motors reach only a share of the commanded speed
};

struct Fault {
  FaultKind kind = FaultKind::CameraBlackout;
  double at_s = 0;                                         ///< since the robot was switched on
  double for_s = std::numeric_limits<double>::infinity();  ///< unused by instantaneous faults
  TagId tag{};                                             ///< only for the four faults of tags
  TagId other{};                                           ///< swapped with this one
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();       ///< TagMoved, in map axes
  double turn_rad = 0;                                     ///< TagMoved, about map z
  SE3 map_T_copy{};                                        ///< TagDuplicated
  SE2 base_T_put = SE2();                                  ///< Kidnapped: relative to the previous pose
  Eigen::Vector3d carry = Eigen::Vector3d::Zero();         ///< Carried: x, y [m/s] and yaw [rad/s] in base
  double jump_s = 0;                                       ///< ClockJump: positive is forward
  double speed_share = 1;                                  ///< SlipBurst, BatterySag: of the speed …
  double yaw_share = 1;                                    ///< … SlipBurst: and of the yaw rate
};

/// Names in a faults file: "camera_blackout", …
[[nodiscard]] std::span<const std::pair<FaultKind, std::string_view>> fault_names();

/// Whether a fault is active. A clock jump stays active; a kidnapping is never active.
[[nodiscard]] bool active(const Fault& fault, double now_s);
/// Whether any fault of a kind is active.
[[nodiscard]] bool active(std::span<const Fault> faults, FaultKind kind, double now_s);

/// The world with the active tag faults applied, in their order. O(tags).
[[nodiscard]] World with_tag_faults(const World& world, std::span<const Fault> faults, double now_s);
/// The next time at which the result of with_tag_faults() changes; infinite if it never does.
[[nodiscard]] double next_tag_change_s(std::span<const Fault> faults, double now_s);

/// Fails if a fault refers to an unknown tag or has an invalid time or share.
[[nodiscard]] Status check(std::span<const Fault> faults, const World& world);

}  // namespace waymark
