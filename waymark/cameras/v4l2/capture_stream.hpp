#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/cameras/v4l2/address.hpp"
#include "waymark/cameras/v4l2/grey.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark::internal {

/// A buffer that the driver has filled; its bytes are valid until it is given back.
struct FilledBuffer {
  std::uint32_t index = 0;
  std::span<const std::uint8_t> bytes{};
  std::uint32_t sequence = 0;       ///< the driver's number of the picture
  std::optional<Duration> stamp{};  ///< of the steady clock, as the driver stamped it; nothing: another clock
  bool start_of_exposure = false;   ///< of the stamp; else the end of the transfer
  bool damaged = false;             ///< the driver says so
};

/// A device that streams into buffers mapped from its driver (VIDIOC_REQBUFS with V4L2_MEMORY_MMAP). take()
/// is for one thread; give_back() may be called from another.
class CaptureStream {
 public:
  /// Opens the device, sets format, rate and controls, and begins. Errors: as open_device(); Unsupported: no
  /// format that fits; Unreadable: another program streams.
  [[nodiscard]] static Result<std::shared_ptr<CaptureStream>> open(const V4l2Options& options);
  CaptureStream(const CaptureStream&) = delete;
  CaptureStream& operator=(const CaptureStream&) = delete;
  ~CaptureStream();

  /// Waits for a picture until `most`, or until `wake` becomes readable.
  void wait(Duration most, int wake) const;
  /// The next filled buffer, without waiting. NotFound: the device was unplugged.
  [[nodiscard]] Result<std::optional<FilledBuffer>> take();
  void give_back(std::uint32_t index);

  [[nodiscard]] const RawLayout& layout() const { return layout_; }
  [[nodiscard]] double rate_hz() const { return rate_hz_; }
  [[nodiscard]] int number() const { return device_.number(); }
  [[nodiscard]] const std::string& card() const { return card_; }

 private:
  struct Mapping {
    void* data = nullptr;
    std::size_t size = 0;
  };
  CaptureStream(Descriptor device, std::string path) : device_(std::move(device)), path_(std::move(path)) {}
  [[nodiscard]] Status set_mode(const V4l2Options& options);
  [[nodiscard]] Status set_format(const V4l2Options& options);
  void set_rate(double wanted_hz);
  [[nodiscard]] Status map_buffers();
  [[nodiscard]] Status begin();
  [[nodiscard]] Error failed(const std::string& what, int error) const;

  Descriptor device_;
  std::string path_;
  std::string card_{};
  RawLayout layout_{};
  double rate_hz_ = 0;
  std::vector<Mapping> buffers_{};
};

}  // namespace waymark::internal
