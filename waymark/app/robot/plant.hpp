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

/// The sensors and motors behind the wire of a simulated robot (`waymark robot-sim`), in a time of their own.
/// It stops by itself when commands cease, as its robot would.
class Plant : public Robot {
 public:
  /// What its sensors say next, pictures included, stamped by now(); time passes until then. Fails when there
  /// will be no more, and says why.
  virtual Result<Sample> next() = 0;
  /// Of the clock that stamps samples: it may jump.
  [[nodiscard]] virtual SensorTime now() const = 0;
  /// Since it was switched on: never jumps.
  [[nodiscard]] virtual Duration uptime() const = 0;
};

/// Real time for a plant. What a busy computer is late by beyond 100 ms is left out, not made up for: a robot
/// must not drive faster than commanded. Samples are to be stamped that much later.
class PlantPace {
 public:
  /// `clock`: steady. `uptime`: of the plant, now. `say` is told of time that was left out, at most once in
  /// ten seconds.
  PlantPace(std::function<Duration()> clock, Duration uptime, std::function<void(const std::string&)> say);

  /// How long until the clock has come to this uptime; 0 if it has.
  [[nodiscard]] Duration ahead(Duration uptime) const;
  /// Leaves out what is late by too much. Call it once a sample.
  void leave_out(Duration uptime);
  /// All that was left out.
  [[nodiscard]] Duration left_out() const { return left_out_; }

 private:
  std::function<Duration()> clock_;
  std::function<void(const std::string&)> say_;
  Duration began_;  ///< by the clock, when uptime was zero
  Duration left_out_{};
  Duration said_{};     ///< left_out() when it was said last
  Duration next_said_;  ///< by the clock
};

/// A robot of the simulator, with a renderer behind its cameras where the setup has pictures. Fails where
/// they cannot be made.
[[nodiscard]] Result<std::unique_ptr<Plant>> make_simulated_plant(const SimulatedSetup& setup,
                                                                  const SE2& map_T_base);

struct ProcessPlantOptions {
  std::vector<std::string> sends{};  ///< types of lines without which it is of no use; empty: any
  double watchdog_s = 0.5;           ///< commands that cease for so long make it stop
  std::function<bool()> should_stop = [] { return false; };
  std::function<void(const std::string&)> on_text = [](const std::string&) {};  ///< what it has to say
};

/// A simulation of somebody else's that speaks the protocol of robot processes
/// (docs/formats/robot-process.md): of its physics and sensors nothing is known here. One in lockstep goes on
/// with each command; one that does not is taken as fast as it speaks. Its stamps begin at zero. Fails when
/// it says no hello, or does not send what is needed.
[[nodiscard]] Result<std::unique_ptr<Plant>> start_process_plant(const RobotCommand& command,
                                                                 const ProcessPlantOptions& options);

}  // namespace waymark
