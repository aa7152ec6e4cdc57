#include "tests/fake_v4l2/fake_device.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iterator>
#include <utility>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include "tests/fake_v4l2/kernel_call.hpp"

namespace fake_v4l2 {
namespace {

constexpr std::uint32_t kMaxBuffers = 8;
constexpr std::int64_t kSecond_ns = 1'000'000'000;

std::int64_t now_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * kSecond_ns + now.tv_nsec;
}

std::vector<std::uint8_t> bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::uint32_t stride_of(const Mode& mode) {
  const bool packed = mode.fourcc == V4L2_PIX_FMT_YUYV || mode.fourcc == V4L2_PIX_FMT_UYVY;
  return mode.fourcc == V4L2_PIX_FMT_MJPEG ? 0 : mode.width * (packed ? 2 : 1);
}

std::uint32_t size_of(const Mode& mode) {
  if (mode.fourcc == V4L2_PIX_FMT_MJPEG) return mode.width * mode.height * 2;
  const std::uint32_t plane = stride_of(mode) * mode.height;
  return mode.fourcc == V4L2_PIX_FMT_NV12 ? plane + plane / 2 : plane;
}

/// Splits consecutive JPEG files: each ends before the next start marker that follows an end marker.
std::vector<std::vector<std::uint8_t>> split_jpeg(const std::vector<std::uint8_t>& all) {
  std::vector<std::vector<std::uint8_t>> frames;
  const std::uint8_t border[] = {0xff, 0xd9, 0xff, 0xd8};
  auto begin = all.begin();
  while (begin != all.end()) {
    auto end = std::search(begin, all.end(), std::begin(border), std::end(border));
    if (end != all.end()) end += 2;
    frames.emplace_back(begin, end);
    begin = end;
  }
  return frames;
}

std::vector<std::vector<std::uint8_t>> split_raw(const std::vector<std::uint8_t>& all, std::size_t size) {
  std::vector<std::vector<std::uint8_t>> frames;
  for (std::size_t at = 0; at + size <= all.size(); at += size) {
    const auto begin = all.begin() + static_cast<std::ptrdiff_t>(at);
    frames.emplace_back(begin, begin + static_cast<std::ptrdiff_t>(size));
  }
  return frames;
}

timespec timespec_of(std::int64_t ns) {
  return {static_cast<time_t>(ns / kSecond_ns), static_cast<long>(ns % kSecond_ns)};
}

}  // namespace

Device::Device(std::string folder, std::string node)
    : folder_(std::move(folder)),
      node_(std::move(node)),
      about_(read_description(node_)),
      timer_(timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC)),
      memory_(memfd_create("fake_v4l2", MFD_CLOEXEC)) {}

Device::~Device() {
  if (bytes_ != nullptr) munmap(bytes_, mapped_);
  kernel_call(SYS_close, memory_);  // the caller that opened the device closes the timer
}

std::uint32_t Device::buffer_size() const {
  constexpr std::uint32_t kPage = 65536;
  return (size_of(about_.modes[mode_]) + kPage - 1) / kPage * kPage;
}

std::int64_t Device::due_ns(std::uint64_t frame) const {
  const double after_s = static_cast<double>(frame + 1) / about_.modes[mode_].rate_hz;
  return began_ns_ + static_cast<std::int64_t>(after_s * 1e9);
}

void Device::load() {
  const Mode& mode = about_.modes[mode_];
  const auto all = bytes_of(folder_ + "/" + mode.file);
  frames_ = mode.fourcc == V4L2_PIX_FMT_MJPEG ? split_jpeg(all) : split_raw(all, size_of(mode));
}

int Device::format(v4l2_format& format, bool set) {
  if (format.type != V4L2_BUF_TYPE_VIDEO_CAPTURE || about_.modes.empty()) return EINVAL;
  if (set && fault("busy")) return EBUSY;
  if (set) {
    // Like a driver: the nearest available mode instead of an error.
    const v4l2_pix_format wanted = format.fmt.pix;
    const auto far = [&](const Mode& mode) {
      return (mode.fourcc == wanted.pixelformat ? 0.0 : 1e9) +
             std::abs(static_cast<double>(mode.width) - wanted.width) +
             std::abs(static_cast<double>(mode.height) - wanted.height);
    };
    const auto best = std::ranges::min_element(about_.modes, {}, far);
    mode_ = static_cast<std::size_t>(best - about_.modes.begin());
  }
  const Mode& mode = about_.modes[mode_];
  format.fmt.pix = {};
  format.fmt.pix.width = mode.width;
  format.fmt.pix.height = mode.height;
  format.fmt.pix.pixelformat = mode.fourcc;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  format.fmt.pix.bytesperline = stride_of(mode);
  format.fmt.pix.sizeimage = size_of(mode);
  format.fmt.pix.colorspace = V4L2_COLORSPACE_SRGB;
  return 0;
}

int Device::rate(v4l2_streamparm& parameters) const {
  parameters.parm.capture.capability = V4L2_CAP_TIMEPERFRAME;
  parameters.parm.capture.timeperframe = {
      1000, static_cast<std::uint32_t>(std::lround(1000 * about_.modes[mode_].rate_hz))};
  return 0;
}

int Device::buffers(v4l2_requestbuffers& request) {
  if (fault("busy")) return EBUSY;
  if (bytes_ != nullptr) munmap(std::exchange(bytes_, nullptr), mapped_);
  request.count = std::min(request.count, kMaxBuffers);
  request.capabilities = V4L2_BUF_CAP_SUPPORTS_MMAP;
  used_.assign(request.count, 0);
  queued_.clear();
  done_.clear();
  if (request.count == 0) return 0;
  mapped_ = std::size_t{buffer_size()} * request.count;
  if (ftruncate(memory_, static_cast<off_t>(mapped_)) != 0) return errno;
  void* data = reinterpret_cast<void*>(
      kernel_call(SYS_mmap, 0, mapped_, PROT_READ | PROT_WRITE, MAP_SHARED, memory_, off_t{0}));
  if (data == MAP_FAILED) {
    used_.clear();
    return errno;
  }
  bytes_ = static_cast<std::uint8_t*>(data);
  return 0;
}

int Device::query(v4l2_buffer& buffer) const {
  if (buffer.index >= used_.size()) return EINVAL;
  buffer.length = buffer_size();
  buffer.m.offset = buffer.index * buffer_size();
  buffer.flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  return 0;
}

void Device::fill(std::uint32_t buffer, std::uint64_t frame) {
  if (frames_.empty()) return;
  const auto frozen = fault("freeze");
  const std::uint64_t shown = frozen ? std::min(frame, *frozen) : frame;
  const std::vector<std::uint8_t>& from = frames_[shown % frames_.size()];
  std::uint8_t* to = bytes_ + std::size_t{buffer} * buffer_size();
  std::memcpy(to, from.data(), std::min<std::size_t>(from.size(), buffer_size()));
  used_[buffer] = static_cast<std::uint32_t>(from.size());
  if (const auto black = fault("black"); black && frame >= *black) std::memset(to, 16, from.size());
  if (const auto half = fault("short"); half && frame % *half == *half - 1) used_[buffer] /= 2;
}

/// Performs what a driver would have done up to now.
void Device::advance() {
  const std::int64_t now = now_ns();
  const auto stalled = fault("stall");
  while (streaming_ && due_ns(next_frame_) <= now && !(stalled && next_frame_ >= *stalled)) {
    if (!queued_.empty()) {
      fill(queued_.front(), next_frame_);
      done_.push_back({queued_.front(), next_frame_});
      queued_.pop_front();
    }
    ++next_frame_;
  }
}

void Device::arm() {
  itimerspec when{};
  if (!done_.empty())
    when.it_value = {0, 1};
  else if (streaming_ && !queued_.empty())
    when.it_value = timespec_of(due_ns(next_frame_));
  timerfd_settime(timer_, TFD_TIMER_ABSTIME, &when, nullptr);
}

int Device::take(v4l2_buffer& buffer) {
  if (!streaming_) return EINVAL;
  advance();
  if (done_.empty()) {
    arm();
    return EAGAIN;
  }
  const Done done = done_.front();
  done_.pop_front();
  arm();
  buffer = {};
  buffer.index = done.buffer;
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.length = buffer_size();
  buffer.m.offset = done.buffer * buffer_size();
  buffer.bytesused = used_[done.buffer];
  buffer.field = V4L2_FIELD_NONE;
  buffer.sequence = static_cast<std::uint32_t>(done.frame);
  std::int64_t stamp = due_ns(done.frame);
  if (about_.stamps == "soe") stamp -= static_cast<std::int64_t>(about_.latency_ms * 1e6);
  if (const auto back = fault("back"); back && done.frame >= *back) stamp -= 5 * kSecond_ns;
  const timespec time = timespec_of(stamp);
  buffer.timestamp = {time.tv_sec, time.tv_nsec / 1000};
  buffer.flags = about_.stamps == "copy" ? V4L2_BUF_FLAG_TIMESTAMP_COPY : V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  if (about_.stamps == "soe") buffer.flags |= V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  if (const auto flag = fault("flag"); flag && done.frame % *flag == *flag - 1)
    buffer.flags |= V4L2_BUF_FLAG_ERROR;
  return 0;
}

int Device::stream(bool on) {
  if (on && (fault("busy") || about_.modes.empty())) return EBUSY;
  if (on) load();
  streaming_ = on;
  began_ns_ = now_ns();
  next_frame_ = 0;
  if (!on) queued_.clear();
  done_.clear();
  arm();
  return 0;
}

int Device::call(unsigned long request, void* argument) {
  if (kernel_call(SYS_faccessat, AT_FDCWD, node_.c_str(), F_OK) != 0) return ENODEV;
  switch (static_cast<std::uint32_t>(request)) {
    case VIDIOC_G_FMT:
      return format(*static_cast<v4l2_format*>(argument), false);
    case VIDIOC_TRY_FMT:
    case VIDIOC_S_FMT:
      return format(*static_cast<v4l2_format*>(argument), true);
    case VIDIOC_G_PARM:
    case VIDIOC_S_PARM:
      return rate(*static_cast<v4l2_streamparm*>(argument));
    case VIDIOC_REQBUFS:
      return buffers(*static_cast<v4l2_requestbuffers*>(argument));
    case VIDIOC_QUERYBUF:
      return query(*static_cast<v4l2_buffer*>(argument));
    case VIDIOC_DQBUF:
      return take(*static_cast<v4l2_buffer*>(argument));
    case VIDIOC_STREAMON:
      return stream(true);
    case VIDIOC_STREAMOFF:
      return stream(false);
    case VIDIOC_QUERYCTRL:
      return query_control(*static_cast<v4l2_queryctrl*>(argument));
    case VIDIOC_QUERYMENU:
      return query_menu(*static_cast<v4l2_querymenu*>(argument));
    case VIDIOC_G_CTRL:
      return control(*static_cast<v4l2_control*>(argument), false);
    case VIDIOC_S_CTRL:
      return control(*static_cast<v4l2_control*>(argument), true);
    case VIDIOC_QBUF: {
      auto& buffer = *static_cast<v4l2_buffer*>(argument);
      if (buffer.index >= used_.size() || std::ranges::find(queued_, buffer.index) != queued_.end())
        return EINVAL;
      advance();
      queued_.push_back(buffer.index);
      arm();
      return 0;
    }
    default:
      return enumerate(request, argument);
  }
}

}  // namespace fake_v4l2
