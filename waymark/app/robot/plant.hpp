#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "waymark/base/time.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"
#include "waymark/robots/watchdog/robot_command.hpp"
#include "waymark/samples/robot.hpp"

namespace waymark {

/// The sensors and motors behind the wire of a simulated robot (`waymark robot-sim`), with their own clock.
/// Like the real robot, it stops if commands cease.
class Plant : public Robot {
 public:
  /// The next sample, including images, stamped by now(); simulated time advances to it. Fails with the
  /// reason if there are no more samples.
  virtual Result<Sample> next() = 0;
  /// The clock that stamps samples; it may jump.
  [[nodiscard]] virtual SensorTime now() const = 0;
  /// Time since the robot was switched on; monotonic.
  [[nodiscard]] virtual Duration uptime() const = 0;
};

/// Real time for a plant. If a busy computer is more than 100 ms late, the excess is skipped and not caught
/// up, because a robot must not drive faster than commanded. The caller stamps samples later by left_out().
class PlantPace {
 public:
  /// `clock`: steady. `uptime`: current uptime of the plant. `note` gets a message about skipped time, at
  /// most once in ten seconds.
  PlantPace(std::function<Duration()> clock, Duration uptime, std::function<void(const std::string&)> note);

  /// Time until the clock reaches this uptime; 0 if it has.
  [[nodiscard]] Duration ahead(Duration uptime) const;
  /// Skips excess delay. Call it once per sample.
  void leave_out(Duration uptime);
  /// Sum of all skipped time.
  [[nodiscard]] Duration left_out() const { return left_out_; }

 private:
  std::function<Duration()> clock_;
  std::function<void(const std::string&)> note_;
  Duration began_;  ///< time of the clock at uptime zero
  Duration left_out_{};
  Duration noted_{};    ///< left_out() at the last note
  Duration next_note_;  ///< time of the clock
};

/// A robot of the simulator, with a renderer for its cameras if the setup has images. Fails if the renderer
/// cannot be made.
[[nodiscard]] Result<std::unique_ptr<Plant>> make_simulated_plant(const SimulatedSetup& setup,
                                                                  const SE2& map_T_base);

struct ProcessPlantOptions {
  std::vector<std::string> sends{};  ///< types of lines that it must send; empty: any
  double watchdog_s = 0.5;           ///< it stops this long after the last command
  std::function<bool()> should_stop = [] { return false; };
  std::function<void(const std::string&)> on_text = [](const std::string&) {};  ///< gets its texts
};

/// Another simulation with the protocol of robot processes (docs/formats/robot-process.md) and unknown
/// physics and sensors. In lockstep it advances with each command; otherwise its samples are passed on as
/// they arrive. Its stamps are shifted to begin at zero. Fails if it sends no hello, or not the required
/// lines.
[[nodiscard]] Result<std::unique_ptr<Plant>> start_process_plant(const RobotCommand& command,
                                                                 const ProcessPlantOptions& options);

}  // namespace waymark
