#include "waymark/cameras/v4l2/capture_thread.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <utility>

#include <linux/videodev2.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <unistd.h>

#include <fmt/format.h>

#include "waymark/cameras/v4l2/controls.hpp"
#include "waymark/cameras/v4l2/device.hpp"
#include "waymark/cameras/v4l2/device_list.hpp"

namespace waymark::internal {
namespace {

/// One buffer is being converted, one is waiting for take(), and the driver fills the others.
constexpr std::uint32_t kBuffers = 6;
constexpr std::uint32_t kMinBuffers = 3;

v4l2_buffer of_capture(std::uint32_t index = 0) {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

std::optional<Duration> stamp_of(const v4l2_buffer& buffer) {
  if ((buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) != V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC) return std::nullopt;
  return std::chrono::seconds(buffer.timestamp.tv_sec) + std::chrono::microseconds(buffer.timestamp.tv_usec);
}

}  // namespace

Error CaptureStream::failed(const std::string& what, int error) const {
  return device_error(path_, what, error);
}

Result<std::shared_ptr<CaptureStream>> CaptureStream::open(const V4l2Options& options) {
  auto device = open_device(options.device);
  if (!device) return tl::unexpected(device.error());
  const std::shared_ptr<CaptureStream> stream(new CaptureStream(std::move(*device), options.device));
  const auto named = read_capabilities(stream->number(), options.device);
  if (!named) return tl::unexpected(named.error());
  stream->card_ = named->card;
  Status status = stream->set_mode(options);
  for (const auto& [name, value] : options.controls)
    if (status) status = write_control(stream->number(), options.device, name, value);
  if (status && options.lock) status = lock_controls(stream->number(), options.device);
  if (status) status = stream->map_buffers();
  if (status) status = stream->begin();
  if (!status) return tl::unexpected(status.error());
  return stream;
}

Status CaptureStream::set_mode(const V4l2Options& options) {
  if (Status set = set_format(options); !set) return set;
  set_rate(rate_hz_);
  return {};
}

Status CaptureStream::set_format(const V4l2Options& options) {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (const int error = control_device(number(), VIDIOC_G_FMT, &format); error != 0)
    return tl::unexpected(failed("cannot read its format", error));
  v4l2_pix_format& pixels = format.fmt.pix;
  const WantedMode now{.width = static_cast<int>(pixels.width), .height = static_cast<int>(pixels.height)};
  const auto wanted = choose_mode(read_modes(number()), options, now);
  if (!wanted) return tl::unexpected(wanted.error());
  rate_hz_ = wanted->rate_hz;
  pixels = {};
  pixels.width = static_cast<std::uint32_t>(wanted->width);
  pixels.height = static_cast<std::uint32_t>(wanted->height);
  pixels.pixelformat = fourcc_of(wanted->format);
  pixels.field = V4L2_FIELD_ANY;
  if (const int error = control_device(number(), VIDIOC_S_FMT, &format); error != 0)
    return tl::unexpected(failed("rejects its format", error));
  const bool agreed = pixels.pixelformat == fourcc_of(wanted->format) &&
                      static_cast<int>(pixels.width) == wanted->width &&
                      static_cast<int>(pixels.height) == wanted->height;
  const bool packed = wanted->format == PixelFormat::Yuyv || wanted->format == PixelFormat::Uyvy;
  const auto row_bytes = pixels.width * (packed ? 2U : 1U);
  if (!agreed)
    return fail(ErrorCode::Unsupported,
                fmt::format("requested {} {}x{}, but the camera delivers {} {}x{}", to_string(wanted->format),
                            wanted->width, wanted->height, fourcc_name(pixels.pixelformat), pixels.width,
                            pixels.height),
                {.source = path_}, "Request another size or format.");
  layout_ = {wanted->format, wanted->width, wanted->height,
             static_cast<int>(std::max(pixels.bytesperline, row_bytes))};
  return {};
}

void CaptureStream::set_rate(double wanted_hz) {
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (wanted_hz > 0) {
    constexpr std::uint32_t kPerThousand = 1000;
    parameters.parm.capture.timeperframe = {
        kPerThousand, static_cast<std::uint32_t>(std::lround(wanted_hz * kPerThousand))};
    (void)control_device(number(), VIDIOC_S_PARM, &parameters);
  }
  // The driver may report the actual rate; otherwise the requested one is assumed.
  const v4l2_fract& interval = parameters.parm.capture.timeperframe;
  if (control_device(number(), VIDIOC_G_PARM, &parameters) == 0 && interval.numerator > 0)
    rate_hz_ = static_cast<double>(interval.denominator) / interval.numerator;
}

Status CaptureStream::map_buffers() {
  v4l2_requestbuffers request{};
  request.count = kBuffers;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int error = control_device(number(), VIDIOC_REQBUFS, &request); error != 0)
    return tl::unexpected(failed("cannot allocate buffers", error));
  if (request.count < kMinBuffers)
    return fail(ErrorCode::Unsupported, fmt::format("the camera has only {} buffers", request.count),
                {.source = path_}, "Request a smaller size.");
  for (std::uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer = of_capture(i);
    if (const int error = control_device(number(), VIDIOC_QUERYBUF, &buffer); error != 0)
      return tl::unexpected(failed("cannot query its buffers", error));
    void* data =
        ::mmap(nullptr, buffer.length, PROT_READ, MAP_SHARED, number(), static_cast<off_t>(buffer.m.offset));
    if (data == MAP_FAILED) return tl::unexpected(failed("cannot map its buffers", errno));  // NOLINT
    buffers_.push_back({data, buffer.length});
  }
  return {};
}

Status CaptureStream::begin() {
  for (std::uint32_t i = 0; i < buffers_.size(); ++i) give_back(i);
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  const int error = control_device(number(), VIDIOC_STREAMON, &type);
  return error == 0 ? Status() : tl::unexpected(failed("cannot start streaming", error));
}

CaptureStream::~CaptureStream() {
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  (void)control_device(number(), VIDIOC_STREAMOFF, &type);
  for (const Mapping& buffer : buffers_) ::munmap(buffer.data, buffer.size);
}

void CaptureStream::wait(Duration timeout, int wake) const {
  std::array<pollfd, 2> watched = {pollfd{number(), POLLIN, 0}, pollfd{wake, POLLIN, 0}};
  const auto ms = std::chrono::ceil<std::chrono::milliseconds>(timeout).count();
  (void)::poll(watched.data(), watched.size(), static_cast<int>(ms));
}

Result<std::optional<FilledBuffer>> CaptureStream::take() {
  v4l2_buffer buffer = of_capture();
  const int error = control_device(number(), VIDIOC_DQBUF, &buffer);
  if (error == EAGAIN) return std::optional<FilledBuffer>();
  if (error != 0) return tl::unexpected(failed("cannot deliver an image", error));
  if (buffer.index >= buffers_.size())
    return fail(ErrorCode::Unreadable, "the driver returned an invalid buffer", {.source = path_});
  const Mapping& mapping = buffers_[buffer.index];
  const auto* bytes = static_cast<const std::uint8_t*>(mapping.data);
  return std::optional(FilledBuffer{
      .index = buffer.index,
      .bytes = {bytes, std::min<std::size_t>(buffer.bytesused, mapping.size)},
      .sequence = buffer.sequence,
      .stamp = stamp_of(buffer),
      .start_of_exposure = (buffer.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE,
      .damaged = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0});
}

void CaptureStream::give_back(std::uint32_t index) {
  v4l2_buffer buffer = of_capture(index);
  (void)control_device(number(), VIDIOC_QBUF, &buffer);  // take() detects an unplugged device
}

namespace {

constexpr Duration kPatience = std::chrono::milliseconds(500);
constexpr Duration kRetry = std::chrono::milliseconds(250);
constexpr Duration kSilence = std::chrono::seconds(2);
constexpr Duration kExposureAge = std::chrono::seconds(1);  // each query is a USB transfer
constexpr std::size_t kMaxPending = 16;

}  // namespace

CaptureThread::CaptureThread(std::shared_ptr<CaptureStream> stream, V4l2Options options, std::string by_id)
    : options_(std::move(options)),
      by_id_(std::move(by_id)),
      wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      last_image_(steady_now()),
      stream_(std::move(stream)),
      thread_([this] { run(); }) {}

CaptureThread::~CaptureThread() {
  {
    const std::scoped_lock hold(mutex_);
    stop_ = true;
  }
  const std::uint64_t one = 1;
  (void)!::write(wake_.number(), &one, sizeof one);
  thread_.join();
}

void CaptureThread::run() {
  while (true) {
    std::shared_ptr<CaptureStream> stream;
    {
      const std::scoped_lock hold(mutex_);
      if (stop_ || ended_) return;
      stream = stream_;
    }
    if (stream != nullptr)
      capture(*stream);
    else
      find_again();
  }
}

void CaptureThread::capture(CaptureStream& stream) {
  refresh_exposure(stream);
  stream.wait(kPatience, wake_.number());
  while (true) {
    auto filled = stream.take();
    if (!filled) return lose(filled.error());
    if (!*filled) break;
    put(**filled);
  }
  if (!silent_ && steady_now() - last_image_ > kSilence) {
    silent_ = true;
    report("no image from the camera for two seconds: check its cable");
  }
}

void CaptureThread::put(const FilledBuffer& buffer) {
  const Duration now = steady_now();
  last_image_ = now;
  if (std::exchange(silent_, false)) report("the camera delivers images again");
  const std::uint32_t missing = sequence_ ? buffer.sequence - *sequence_ - 1 : 0;
  sequence_ = buffer.sequence;
  std::optional<TakenImage> replaced;
  {
    const std::scoped_lock hold(mutex_);
    if (missing < 0x80000000U) counts_.lost += missing;  // otherwise the driver restarted its numbers
    replaced = std::exchange(newest_, TakenImage{stream_, buffer, now, exposure_});
    if (replaced) ++counts_.dropped;
  }
  if (replaced) replaced->stream->give_back(replaced->buffer.index);
  changed_.notify_all();
}

void CaptureThread::lose(const Error& why) {
  lost_at_ = steady_now();
  sequence_.reset();
  std::shared_ptr<CaptureStream> closed;
  {
    const std::scoped_lock hold(mutex_);
    closed = std::move(stream_);
    stream_.reset();
    newest_.reset();
  }
  report(fmt::format("{}; waiting for it", to_string(Error{why.code, why.message, why.place, {}})));
}

void CaptureThread::find_again() {
  {
    std::unique_lock hold(mutex_);
    if (changed_.wait_for(hold, kRetry, [this] { return stop_; })) return;
  }
  V4l2Options again = options_;
  auto stream = CaptureStream::open(again);
  if (!stream && !by_id_.empty()) {
    again.device = by_id_;
    stream = CaptureStream::open(again);
  }
  if (!stream && steady_now() - lost_at_ < options_.reconnect_within) return;
  if (stream) report(fmt::format("{}: the camera is connected again", again.device));
  {
    const std::scoped_lock hold(mutex_);
    if (stream)
      stream_ = std::move(*stream);
    else
      ended_ = stream.error();
    ask_exposure_ = true;
  }
  last_image_ = steady_now();
  changed_.notify_all();
}

void CaptureThread::refresh_exposure(CaptureStream& stream) {
  const Duration now = steady_now();
  {
    const std::scoped_lock hold(mutex_);
    if (!std::exchange(ask_exposure_, false) && now - exposure_asked_ < kExposureAge) return;
  }
  exposure_asked_ = now;
  const std::optional<Duration> exposure = exposure_of(stream.number());
  const std::scoped_lock hold(mutex_);
  exposure_ = exposure;
}

void CaptureThread::report(std::string text) {
  {
    const std::scoped_lock hold(mutex_);
    if (reports_.size() < kMaxPending) reports_.push_back(std::move(text));
  }
  changed_.notify_all();
}

std::optional<TakenImage> CaptureThread::take(Duration timeout) {
  std::unique_lock hold(mutex_);
  changed_.wait_for(hold, timeout, [this] { return newest_ || !reports_.empty() || ended_; });
  if (!reports_.empty()) return std::nullopt;
  return std::exchange(newest_, std::nullopt);
}

std::optional<std::string> CaptureThread::take_reports() {
  const std::scoped_lock hold(mutex_);
  if (reports_.empty()) return std::nullopt;
  std::string oldest = std::move(reports_.front());
  reports_.pop_front();
  return oldest;
}

bool CaptureThread::more() const {
  const std::scoped_lock hold(mutex_);
  return newest_ || !reports_.empty() || ended_;
}

std::optional<Error> CaptureThread::ended() const {
  const std::scoped_lock hold(mutex_);
  return reports_.empty() ? ended_ : std::nullopt;
}

std::shared_ptr<CaptureStream> CaptureThread::stream() const {
  const std::scoped_lock hold(mutex_);
  return stream_;
}

CameraCounts CaptureThread::counts() const {
  const std::scoped_lock hold(mutex_);
  return counts_;
}

void CaptureThread::exposure_changed() {
  const std::scoped_lock hold(mutex_);
  ask_exposure_ = true;
}

}  // namespace waymark::internal
