#include "waymark/cameras/v4l2/picture_stamps.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace waymark::internal {
namespace {

constexpr Duration kFuture = std::chrono::milliseconds(20);  // the tick of a driver's clock, with room
constexpr Duration kLongAgo = std::chrono::seconds(2);

}  // namespace

const char* PictureStamps::fault_of(const std::optional<Duration>& driver, Duration arrived) const {
  if (!driver) return "are not of the steady clock";
  if (*driver > arrived + kFuture) return "lie in the future";
  if (*driver < arrived - kLongAgo) return "lie more than two seconds back";
  if (last_driver_ && *driver <= *last_driver_) return "do not grow";
  return nullptr;
}

PictureStamps::Stamped PictureStamps::add(std::optional<Duration> driver, bool start_of_exposure,
                                          std::optional<Duration> exposure, Duration arrived) {
  const char* fault = fault_of(driver, arrived);
  if (driver) last_driver_ = driver;
  if (fault != nullptr && !std::exchange(said_, true))
    words_ = fmt::format("the driver's time stamps {}: pictures are stamped when they arrive", fault);
  const Duration half = exposure.value_or(Duration(0)) / 2;
  const bool begins = fault == nullptr && start_of_exposure;
  const Duration middle = (fault == nullptr ? *driver : arrived) + (begins ? half : -half);
  last_ = std::max(middle, last_ + Duration(1));
  return {last_, fault == nullptr};
}

std::optional<std::string> PictureStamps::take_words() { return std::exchange(words_, std::nullopt); }

}  // namespace waymark::internal
