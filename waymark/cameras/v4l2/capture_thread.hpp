#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/cameras/v4l2/address.hpp"
#include "waymark/cameras/v4l2/images.hpp"
#include "waymark/robots/watchdog/pipes.hpp"
#include "waymark/samples/live_camera.hpp"

namespace waymark::internal {

/// A buffer filled by the driver; its bytes are valid until it is returned with give_back().
struct FilledBuffer {
  std::uint32_t index = 0;
  std::span<const std::uint8_t> bytes{};
  std::uint32_t sequence = 0;       ///< the driver's number of the image
  std::optional<Duration> stamp{};  ///< the driver's stamp; empty if it is not from the steady clock
  bool start_of_exposure = false;  ///< the stamp marks the start of the exposure, not the end of the transfer
  bool damaged = false;            ///< reported by the driver
};

/// A device that streams into buffers mapped from its driver (VIDIOC_REQBUFS with V4L2_MEMORY_MMAP). take()
/// must be called from one thread; give_back() may be called from another.
class CaptureStream {
 public:
  /// Opens the device, sets format, rate and controls, and starts streaming. Errors: those of open_device();
  /// Unsupported (no matching format), Unreadable (another program is streaming).
  [[nodiscard]] static Result<std::shared_ptr<CaptureStream>> open(const V4l2Options& options);
  CaptureStream(const CaptureStream&) = delete;
  CaptureStream& operator=(const CaptureStream&) = delete;
  ~CaptureStream();

  /// Waits for an image up to `timeout`, or until `wake` becomes readable.
  void wait(Duration timeout, int wake) const;
  /// The next filled buffer; does not block. Fails (NotFound) if the device has been unplugged.
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

/// The newest image of a stream, still in the driver's memory. Shares ownership of the stream until its
/// buffer is returned.
struct TakenImage {
  std::shared_ptr<CaptureStream> stream{};
  FilledBuffer buffer{};
  Duration arrived{};  ///< on the steady clock
  std::optional<Duration> exposure{};
};

/// A thread that drains a stream and reopens the device after it has been unplugged.
class CaptureThread {
 public:
  CaptureThread(std::shared_ptr<CaptureStream> stream, V4l2Options options, std::string by_id);
  ~CaptureThread();
  CaptureThread(const CaptureThread&) = delete;
  CaptureThread& operator=(const CaptureThread&) = delete;

  /// Waits for an image, a report, or the end of the stream. The caller must return the image's buffer with
  /// give_back().
  [[nodiscard]] std::optional<TakenImage> take(Duration timeout);
  [[nodiscard]] std::optional<std::string> take_reports();
  [[nodiscard]] bool more() const;
  /// The error that ended the stream; empty while the stream is running.
  [[nodiscard]] std::optional<Error> ended() const;
  /// The current stream; null while the camera is unplugged.
  [[nodiscard]] std::shared_ptr<CaptureStream> stream() const;
  [[nodiscard]] CameraCounts counts() const;
  /// Makes the next image query the exposure time again.
  void exposure_changed();

 private:
  void run();
  void capture(CaptureStream& stream);
  void put(const FilledBuffer& buffer);
  void lose(const Error& why);
  void find_again();
  void report(std::string text);
  void refresh_exposure(CaptureStream& stream);

  V4l2Options options_;
  std::string by_id_;
  Descriptor wake_;
  Duration lost_at_{};
  Duration last_image_{};
  Duration exposure_asked_{};
  std::optional<std::uint32_t> sequence_{};
  bool silent_ = false;

  mutable std::mutex mutex_;  ///< guards all members below
  std::condition_variable changed_;
  std::shared_ptr<CaptureStream> stream_;
  std::optional<TakenImage> newest_{};
  std::deque<std::string> reports_{};
  std::optional<Error> ended_{};
  std::optional<Duration> exposure_{};
  CameraCounts counts_{};
  bool ask_exposure_ = true;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace waymark::internal
