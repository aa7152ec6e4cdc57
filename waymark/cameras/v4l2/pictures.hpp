#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/image/image.hpp"

namespace waymark {

/// The pixel formats that are read; the names are the four characters of Video4Linux.
enum class PixelFormat : std::uint8_t { Grey, Nv12, Yuyv, Uyvy, Mjpg };

/// "GREY", "NV12", "YUYV", "UYVY", "MJPG".
[[nodiscard]] const char* to_string(PixelFormat format);
[[nodiscard]] std::optional<PixelFormat> pixel_format_named(std::string_view name);
[[nodiscard]] std::vector<std::string> pixel_format_names();

/// A picture as a device delivers it.
struct RawLayout {
  PixelFormat format = PixelFormat::Grey;
  int width = 0;   ///< [px]
  int height = 0;  ///< [px]
  int stride = 0;  ///< [byte] from row to row; MJPG has none

  friend bool operator==(const RawLayout&, const RawLayout&) = default;
};

/// How many bytes a whole picture of this layout has; 0 for MJPG.
[[nodiscard]] std::size_t bytes_of(const RawLayout& layout);

/// The luma of a picture, as stored: full range or 16 to 235. Unreadable: fewer bytes than the picture needs,
/// JPEG data that are damaged, or of another size than the layout says.
[[nodiscard]] Result<Image> to_grey(std::span<const std::uint8_t> bytes, const RawLayout& layout);

}  // namespace waymark

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
