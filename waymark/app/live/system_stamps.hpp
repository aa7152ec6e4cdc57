#pragma once

#include <functional>
#include <optional>
#include <string>

#include "waymark/base/time.hpp"

namespace waymark {

/// The clocks of this computer; tests give their own.
struct SystemClocks {
  std::function<Duration()> steady;  ///< never goes back, counts from the start of the computer
  std::function<Duration()> system;  ///< since 1970, can be set
};
[[nodiscard]] SystemClocks system_clocks();

/// Stamps of the steady clock as times since 1970. The difference of the clocks is taken once, so that stamps
/// keep their distances when the system's clock is set; that it was set is said.
class SystemStamps {
 public:
  explicit SystemStamps(SystemClocks clocks = system_clocks());

  [[nodiscard]] SensorTime at(SensorTime steady) const { return steady + difference_; }
  /// Now, as at() has it.
  [[nodiscard]] SensorTime now() const { return SensorTime(clocks_.steady() + difference_); }
  /// Words where the system's clock was set since the last call.
  [[nodiscard]] std::optional<std::string> take_jump();

 private:
  [[nodiscard]] Duration measured() const;

  SystemClocks clocks_;
  Duration difference_{};  ///< system less steady
  Duration latest_{};
};

}  // namespace waymark
