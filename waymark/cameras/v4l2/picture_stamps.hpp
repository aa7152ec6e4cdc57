#pragma once

#include <optional>
#include <string>

#include "waymark/base/time.hpp"

namespace waymark::internal {

/// Stamps of pictures on the steady clock, in the middle of the exposure. What a driver stamps badly (another
/// clock, the future, long ago, backwards) is stamped by its arrival instead.
class PictureStamps {
 public:
  struct Stamped {
    Duration stamp{};     ///< grows from picture to picture
    bool driver = false;  ///< made from the driver's
  };
  /// `driver`: of the start of the exposure or of the end of the transfer; `exposure`: how long it lasted.
  [[nodiscard]] Stamped add(std::optional<Duration> driver, bool start_of_exposure,
                            std::optional<Duration> exposure, Duration arrived);
  /// Once, when the driver's stamps first cannot be used: why.
  [[nodiscard]] std::optional<std::string> take_words();

 private:
  [[nodiscard]] const char* fault_of(const std::optional<Duration>& driver, Duration arrived) const;

  std::optional<Duration> last_driver_{};
  Duration last_{};
  std::optional<std::string> words_{};
  bool said_ = false;
};

}  // namespace waymark::internal
