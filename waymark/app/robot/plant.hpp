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
/// Like a real robot, it stops when it no longer receives commands.
class Plant : public Robot {
 public:
  /// Returns the next sample, which may be an image, timestamped by now(); simulated time advances to it.
  /// Fails with the reason if there are no more samples.
  virtual Result<Sample> next() = 0;
  /// The clock for the timestamps of samples; it may jump.
  [[nodiscard]] virtual SensorTime now() const = 0;
  /// Time since the robot was switched on; monotonic.
  [[nodiscard]] virtual Duration uptime() const = 0;
};

/// Synchronises a plant with real time. If a busy computer is more than 100 ms late, the excess is skipped
/// rather than caught up, because a robot must not drive faster than commanded. The caller delays the
/// timestamps of samples by left_out().
class PlantPace {
 public:
  /// `clock` is a steady clock, and `uptime` the current uptime of the plant. `note` is called with a message
  /// about skipped time, at most once every ten seconds.
  PlantPace(std::function<Duration()> clock, Duration uptime, std::function<void(const std::string&)> note);

  /// Time until the clock reaches this uptime; 0 if it already has.
  [[nodiscard]] Duration ahead(Duration uptime) const;
  /// Skips excess delay. Call it once per sample.
  void leave_out(Duration uptime);
  /// Total skipped time.
  [[nodiscard]] Duration left_out() const { return left_out_; }

 private:
  std::function<Duration()> clock_;
  std::function<void(const std::string&)> note_;
  Duration began_;  ///< clock time at uptime zero
  Duration left_out_{};
  Duration noted_{};    ///< value of left_out() at the last note
  Duration next_note_;  ///< clock time of the next note
};

/// Creates a robot of the simulator, with a renderer for its cameras if the setup has images. Fails if the
/// renderer cannot be created.
[[nodiscard]] Result<std::unique_ptr<Plant>> make_simulated_plant(const SimulatedSetup& setup,
                                                                  const SE2& map_T_base);

struct ProcessPlantOptions {
  std::vector<std::string> sends{};  ///< types of lines that the process must send; any if empty
  double watchdog_s = 0.5;           ///< the process stops its robot this long after the last command
  std::function<bool()> should_stop = [] { return false; };
  std::function<void(const std::string&)> on_text = [](const std::string&) {};  ///< called with texts from
                                                                                ///< the process
};

/// Starts another simulation, with its own physics and sensors, that uses the protocol of robot processes
/// (docs/formats/robot-process.md). In lockstep it advances with each command; otherwise its samples are
/// passed on as they arrive. Its timestamps are shifted to start at zero. Fails if the process does not send
/// a hello message or the required lines.
[[nodiscard]] Result<std::unique_ptr<Plant>> start_process_plant(const RobotCommand& command,
                                                                 const ProcessPlantOptions& options);

}  // namespace waymark
