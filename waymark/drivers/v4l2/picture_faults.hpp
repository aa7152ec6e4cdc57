#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/time.hpp"
#include "waymark/image/image.hpp"

namespace waymark::internal {

/// Notices pictures that are black (a covered lens) or the same for a second (a camera that hangs). Looks at
/// one pixel of 61.
class PictureFaults {
 public:
  /// Words when such a fault begins or ends; `stamp` of the steady clock.
  [[nodiscard]] std::optional<std::string> add(const ImageView& image, Duration stamp);

 private:
  enum class Fault : std::uint8_t { None, Black, Frozen };
  [[nodiscard]] Fault fault_of(const ImageView& image, Duration stamp);

  std::vector<std::uint8_t> sampled_{};
  std::vector<std::uint8_t> before_{};
  Duration same_since_{};
  int same_ = 0;
  Fault fault_ = Fault::None;
};

}  // namespace waymark::internal
