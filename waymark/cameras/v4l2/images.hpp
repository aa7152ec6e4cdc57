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

/// The supported pixel formats, named after their Video4Linux four-character codes.
enum class PixelFormat : std::uint8_t { Grey, Nv12, Yuyv, Uyvy, Mjpg };

/// "GREY", "NV12", "YUYV", "UYVY", "MJPG".
[[nodiscard]] const char* to_string(PixelFormat format);
[[nodiscard]] std::optional<PixelFormat> pixel_format_named(std::string_view name);
[[nodiscard]] std::vector<std::string> pixel_format_names();

/// Memory layout of an image from a device.
struct RawLayout {
  PixelFormat format = PixelFormat::Grey;
  int width = 0;   ///< [px]
  int height = 0;  ///< [px]
  int stride = 0;  ///< bytes from one row to the next; not used for MJPG

  friend bool operator==(const RawLayout&, const RawLayout&) = default;
};

/// Number of bytes of a complete image; 0 for MJPG.
[[nodiscard]] std::size_t bytes_of(const RawLayout& layout);

/// The luma of an image, as stored (full range or 16 to 235). Fails (Unreadable) on truncated data, on
/// damaged JPEG data, or if the size of a JPEG image differs from the layout.
[[nodiscard]] Result<Image> to_grey(std::span<const std::uint8_t> bytes, const RawLayout& layout);

}  // namespace waymark

namespace waymark::internal {

/// Computes steady-clock stamps of images, at the middle of the exposure. Images whose driver stamp is
/// invalid (from another clock, in the future, too old, or decreasing) are stamped with their arrival time
/// instead.
class ImageStamps {
 public:
  struct Stamped {
    Duration stamp{};     ///< strictly increasing
    bool driver = false;  ///< computed from the driver's stamp
  };
  /// `driver` is the stamp of the start of the exposure or of the end of the transfer; `exposure` is the
  /// exposure time.
  [[nodiscard]] Stamped add(std::optional<Duration> driver, bool start_of_exposure,
                            std::optional<Duration> exposure, Duration arrived);
  /// Why the driver's stamps cannot be used; reported once.
  [[nodiscard]] std::optional<std::string> take_reports();

 private:
  [[nodiscard]] const char* fault_of(const std::optional<Duration>& driver, Duration arrived) const;

  std::optional<Duration> last_driver_{};
  Duration last_{};
  std::optional<std::string> report_{};
  bool reported_ = false;
};

/// Detects images that are black (covered lens) or that stay identical for a second. Identical images mean a
/// frozen camera if the driver's numbers and stamps do not advance either. Otherwise the source may be static
/// and free of noise, which is reported once. Samples one pixel in 61.
class ImageFaults {
 public:
  /// Returns a message when a fault begins or ends. `stamp` is on the steady clock; `counted` means that the
  /// driver's number and stamp have advanced since the previous image.
  [[nodiscard]] std::optional<std::string> add(const ImageView& image, Duration stamp, bool counted);

 private:
  enum class Fault : std::uint8_t { None, Black, Still, Frozen };
  [[nodiscard]] Fault fault_of(const ImageView& image, Duration stamp, bool counted);

  std::vector<std::uint8_t> sampled_{};
  std::vector<std::uint8_t> before_{};
  Duration same_since_{};
  int same_ = 0;            ///< number of consecutive identical images
  int same_uncounted_ = 0;  ///< of these, the number for which the driver's number or stamp did not advance
  bool still_reported_ = false;
  Fault fault_ = Fault::None;
};

}  // namespace waymark::internal
