#pragma once

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

}  // namespace waymark
