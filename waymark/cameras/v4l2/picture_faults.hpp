#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/time.hpp"
#include "waymark/image/image.hpp"

namespace waymark::internal {

/// Notices pictures that are black (a covered lens) or the same for a second. The same picture again and
/// again is a camera that hangs where the driver's numbers and stamps stand still as well; else it may be a
/// still source without noise, and is said once. Looks at one pixel of 61.
class PictureFaults {
 public:
  /// Words when such a fault begins or ends; `stamp` of the steady clock. `counted`: number and stamp of the
  /// driver are later than those of the picture before.
  [[nodiscard]] std::optional<std::string> add(const ImageView& image, Duration stamp, bool counted);

 private:
  enum class Fault : std::uint8_t { None, Black, Still, Frozen };
  [[nodiscard]] Fault fault_of(const ImageView& image, Duration stamp, bool counted);

  std::vector<std::uint8_t> sampled_{};
  std::vector<std::uint8_t> before_{};
  Duration same_since_{};
  int same_ = 0;            ///< pictures in a row
  int same_uncounted_ = 0;  ///< of them: the driver did not count on
  bool still_said_ = false;
  Fault fault_ = Fault::None;
};

}  // namespace waymark::internal
