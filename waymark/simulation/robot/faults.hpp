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

/// What goes wrong with a robot and its world, by script.
namespace waymark {

enum class FaultKind : std::uint8_t {
  CameraBlackout,  ///< frames come, dark
  CameraFrozen,    ///< frames come with new stamps, all of them the last one before
  CameraLost,      ///< no frames
  OdometryLost,    ///< neither odometry nor wheels are received; the IMU is
  TagMoved,        ///< a tag hangs elsewhere
  TagRemoved,
  TagDuplicated,  ///< a second tag with a number that is there already
  TagsSwapped,    ///< two tags hang in each other's place
  Kidnapped,      ///< the robot is lifted and put down elsewhere, at once
  ClockJump,      ///< the clock of all sensors jumps, and stays so
  SlipBurst,      ///< the wheels turn more than the robot moves
  CameraStuck,    ///< frames come with new stamps and fresh noise, all from the last place before
  WheelsBlocked,  ///< the wheels do not turn, whatever is commanded
  RobotHeld,      ///< the robot does not move, its wheels turn
  Carried,        ///< the robot is carried evenly while the fault lasts
  BatterySag,     ///< the motors reach a share of the commanded speed
};

struct Fault {
  FaultKind kind = FaultKind::CameraBlackout;
  double at_s = 0;                                         ///< since the robot was switched on
  double for_s = std::numeric_limits<double>::infinity();  ///< what happens at one moment has none
  TagId tag{};                                             ///< of the four about tags
  TagId other{};                                           ///< swapped with this one
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();       ///< TagMoved, in map axes
  double turn_rad = 0;                                     ///< TagMoved, about map z
  SE3 map_T_copy{};                                        ///< TagDuplicated
  SE2 base_T_put = SE2();                                  ///< Kidnapped: from where it stood
  Eigen::Vector3d carry = Eigen::Vector3d::Zero();         ///< Carried: x, y [m/s] and yaw [rad/s] in base
  double jump_s = 0;                                       ///< ClockJump: forward when positive
  double speed_share = 1;                                  ///< SlipBurst, BatterySag: of the speed …
  double yaw_share = 1;                                    ///< … SlipBurst: and of the turning
};

/// Names as they stand in a file: "camera_blackout", …
[[nodiscard]] std::span<const std::pair<FaultKind, std::string_view>> fault_names();

/// Whether a fault is going on. A clock that jumped stays so; a kidnapping goes on at no time.
[[nodiscard]] bool active(const Fault& fault, double now_s);
/// Whether any of a kind is going on.
[[nodiscard]] bool active(std::span<const Fault> faults, FaultKind kind, double now_s);

/// The world as it is with the faults about tags that are going on, in their order. O(tags).
[[nodiscard]] World with_tag_faults(const World& world, std::span<const Fault> faults, double now_s);
/// The next moment at which with_tag_faults() changes; infinite when it never does.
[[nodiscard]] double next_tag_change_s(std::span<const Fault> faults, double now_s);

/// Fails when a fault is about a tag that is not there or a time or share that cannot be.
[[nodiscard]] Status check(std::span<const Fault> faults, const World& world);

}  // namespace waymark
