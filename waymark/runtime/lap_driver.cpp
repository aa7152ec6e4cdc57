#include "waymark/runtime/lap_driver.hpp"

#include <thread>
#include <utility>

namespace waymark {

Result<DriverDecision> PacedDriver::drive(Duration uptime, SensorTime now) {
  if (!start_) start_ = clock_() - uptime;
  const Duration ahead = *start_ + uptime - clock_();
  if (ahead > Duration(0)) wait_(ahead);
  return driver_->drive(uptime, now);
}

std::unique_ptr<LapDriver> in_real_time(std::unique_ptr<LapDriver> driver) {
  return std::make_unique<PacedDriver>(std::move(driver), real_time().clock,
                                       [](Duration ahead) { std::this_thread::sleep_for(ahead); });
}

}  // namespace waymark
