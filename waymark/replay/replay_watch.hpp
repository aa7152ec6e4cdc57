#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

struct WatchOptions {
  double clock_jump_s = 0.3;
  double carried_m = 0.25;
  double carried_rad = 0.5;
  double frozen_s = 1.0;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.clock_jump_s, Field{"clock_jump_s",
                                   "Largest step of the clock between two commands or two odometry samples; "
                                   "a larger one is reported as a clock jump.",
                                   0.05, 10});
    visit(self.carried_m, Field{"carried_m",
                                "Maximum jump of the position relative to odometry; a larger one is reported "
                                "as a robot moved by hand.",
                                0.01, 10});
    visit(self.carried_rad, Field{"carried_rad",
                                  "Maximum jump of the heading relative to odometry; a larger one is "
                                  "reported as a robot moved by hand.",
                                  0.01, 3.2});
    visit(self.frozen_s,
          Field{"frozen_s",
                "Maximum time for which a moving robot may receive the same image; stops when exceeded.",
                0.05, 10});
  }
};

/// Detects faults that a single measurement does not reveal: clock jumps, a robot moved by hand, a frozen
/// camera. It is pure apart from its stored state; time is passed as an argument. Alarms for clock jumps and
/// motion by hand persist until forget() is called, because a person has to check the robot. A late command
/// (overloaded computer) is distinguished from a clock jump by the odometry from that time, which arrives
/// later and has no gap in its timestamps.
class ReplayWatch {
 public:
  explicit ReplayWatch(const WatchOptions& options) : options_(options) {}

  /// Adds the time of the next command.
  void tick(SensorTime now);
  void add(const Odometry& odometry);
  /// Adds a frame and returns whether it is new. A frozen camera repeats every corner exactly while the robot
  /// is moving.
  [[nodiscard]] bool add(const TagFrame& frame);
  [[nodiscard]] bool add(const TagPoseFrame& frame);
  /// Compares a confident estimate with odometry.
  void check(const SE2& map_T_base);

  /// The reason to stop; empty if there is none. `lasting`: whether it persists until forget() is called.
  [[nodiscard]] std::string alarm() const;
  [[nodiscard]] bool lasting() const { return !alarm_.empty(); }
  void forget();

 private:
  /// A time interval.
  struct Gap {
    SensorTime from{};
    SensorTime to{};
    [[nodiscard]] bool overlaps(const Gap& other) const { return from < other.to && other.from < to; }
  };
  /// A tag as it was detected.
  struct SeenTag {
    TagId tag{};
    std::array<double, 8> numbers{};
    friend bool operator==(const SeenTag&, const SeenTag&) = default;
  };
  [[nodiscard]] bool add(SensorTime stamp, const std::string& camera, const std::vector<SeenTag>& tags);
  void report_clock_jump(Duration by);
  void decide_on_command_gap();

  WatchOptions options_;
  std::string alarm_{};
  std::optional<SensorTime> tick_{};
  std::optional<Gap> command_gap_{};   ///< gap between two commands, until its cause is determined
  std::optional<Gap> odometry_gap_{};  ///< the newest gap between two odometry samples
  std::optional<Odometry> odometry_{};
  SE2 odom_T_checked_{};
  std::optional<SE2> map_T_checked_{};
  /// The newest detections from a camera and the time since which they have been repeating.
  struct Shown {
    std::vector<SeenTag> tags{};
    SE2 odom_T_frame{};
    SensorTime since{};
    std::string frozen_message{};
  };
  std::map<std::string, Shown> shown_{};  ///< by camera
};

}  // namespace waymark
