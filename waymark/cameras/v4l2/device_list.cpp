#include "waymark/cameras/v4l2/device_list.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string_view>
#include <tuple>
#include <utility>

#include <dirent.h>
#include <linux/videodev2.h>
#include <unistd.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/cameras/v4l2/controls.hpp"
#include "waymark/cameras/v4l2/device.hpp"
#include "waymark/robots/watchdog/device_file.hpp"

namespace waymark {
namespace {

constexpr std::string_view kPrefix = "video";
constexpr const char* kById = "/dev/v4l/by-id";

std::vector<std::string> names_in(const char* folder) {
  std::vector<std::string> names;
  DIR* entries = ::opendir(folder);
  if (entries == nullptr) return names;
  while (const dirent* entry = ::readdir(entries)) names.emplace_back(entry->d_name);  // NOLINT
  ::closedir(entries);
  return names;
}

std::vector<int> numbers_of_nodes() {
  std::vector<int> numbers;
  for (const std::string& name : names_in("/dev")) {
    int number = 0;
    const char* begin = name.data() + kPrefix.size();
    const char* end = name.data() + name.size();
    if (!name.starts_with(kPrefix) || begin == end) continue;
    const auto [stop, error] = std::from_chars(begin, end, number);
    if (error == std::errc() && stop == end) numbers.push_back(number);
  }
  std::ranges::sort(numbers);
  return numbers;
}

std::string last_name(std::string_view path) { return std::string(path.substr(path.rfind('/') + 1)); }

std::string target_of(const std::string& link) {
  std::array<char, 512> target{};
  const ssize_t length = ::readlink(link.c_str(), target.data(), target.size() - 1);
  return length > 0 ? std::string(target.data()) : std::string();
}

}  // namespace

std::string by_id_of(const std::string& path) {
  if (path.starts_with(kById)) return path;
  for (const std::string& name : names_in(kById)) {
    const std::string link = std::string(kById) + "/" + name;
    if (const std::string target = target_of(link); !target.empty() && last_name(target) == last_name(path))
      return link;
  }
  return {};
}

Result<CameraDevice> describe_camera(const std::string& path) {
  const auto device = internal::open_device(path);
  if (!device) return tl::unexpected(device.error());
  auto described = internal::read_capabilities(device->number(), path);
  if (!described) return described;
  described->modes = internal::read_modes(device->number());
  described->controls = internal::read_controls(device->number());
  described->holder = holder_of(path);
  return described;
}

std::vector<CameraDevice> list_cameras() {
  std::vector<CameraDevice> devices;
  for (const int number : numbers_of_nodes()) {
    const std::string path = "/dev/video" + std::to_string(number);
    auto described = describe_camera(path);
    if (described)
      devices.push_back(std::move(*described));
    else if (described.error().code != ErrorCode::Unsupported)
      devices.push_back({.path = path, .by_id = by_id_of(path), .problem = described.error()});
  }
  return devices;
}

}  // namespace waymark

namespace waymark::internal {
namespace {

constexpr std::uint32_t kMaxEntries = 256;  // per list reported by a driver
constexpr double kUsefulRate_hz = 60;

/// Relative cost of the conversion to grey: copying is cheapest, decoding most expensive.
int work_of(PixelFormat format) {
  switch (format) {
    case PixelFormat::Grey:
      return 0;
    case PixelFormat::Nv12:
      return 1;
    case PixelFormat::Yuyv:
    case PixelFormat::Uyvy:
      return 2;
    case PixelFormat::Mjpg:
      return 3;
  }
  return 4;
}

double rate_of(const v4l2_fract& interval) {
  return interval.numerator == 0 ? 0 : static_cast<double>(interval.denominator) / interval.numerator;
}

std::vector<double> read_rates(int device, std::uint32_t fourcc, int width, int height) {
  std::vector<double> rates;
  for (std::uint32_t i = 0; i < kMaxEntries; ++i) {
    v4l2_frmivalenum entry{};
    entry.index = i;
    entry.pixel_format = fourcc;
    entry.width = static_cast<std::uint32_t>(width);
    entry.height = static_cast<std::uint32_t>(height);
    if (control_device(device, VIDIOC_ENUM_FRAMEINTERVALS, &entry) != 0) break;
    const bool one = entry.type == V4L2_FRMIVAL_TYPE_DISCRETE;
    rates.push_back(rate_of(one ? entry.discrete : entry.stepwise.min));
    if (!one) break;
  }
  std::ranges::sort(rates, std::ranges::greater());
  return rates;
}

void read_sizes(int device, std::uint32_t fourcc, std::vector<CameraMode>& modes) {
  for (std::uint32_t i = 0; i < kMaxEntries; ++i) {
    v4l2_frmsizeenum entry{};
    entry.index = i;
    entry.pixel_format = fourcc;
    if (control_device(device, VIDIOC_ENUM_FRAMESIZES, &entry) != 0) break;
    const bool one = entry.type == V4L2_FRMSIZE_TYPE_DISCRETE;
    CameraMode mode{.format = fourcc_name(fourcc),
                    .readable = pixel_format_named(fourcc_name(fourcc)).has_value(),
                    .width = static_cast<int>(one ? entry.discrete.width : entry.stepwise.max_width),
                    .height = static_cast<int>(one ? entry.discrete.height : entry.stepwise.max_height),
                    .largest = !one};
    if (one) {
      mode.rates_hz = read_rates(device, fourcc, mode.width, mode.height);
    } else {
      mode.min_width = static_cast<int>(entry.stepwise.min_width);
      mode.min_height = static_cast<int>(entry.stepwise.min_height);
    }
    modes.push_back(std::move(mode));
    if (!one) break;
  }
}

std::string modes_text(const std::vector<CameraMode>& modes) {
  constexpr std::size_t kMaxListed = 16;
  std::vector<std::string> names;
  for (const CameraMode& mode : modes)
    if (mode.readable)
      names.push_back(
          fmt::format("{} {}{}x{}", mode.format, mode.largest ? "up to " : "", mode.width, mode.height));
  if (names.empty()) return fmt::format("None of its {} formats and sizes is supported.", modes.size());
  const bool more = names.size() > kMaxListed;
  names.resize(std::min(names.size(), kMaxListed));
  return fmt::format("It delivers {}{}.", fmt::join(names, ", "),
                     more ? " and more (`waymark cameras` lists them)" : "");
}

/// The rate nearest to the requested one, or nearest to the highest useful rate if none is requested.
double best_rate(const CameraMode& mode, double wanted_hz) {
  if (mode.rates_hz.empty()) return wanted_hz;
  const double target_hz = wanted_hz > 0 ? wanted_hz : kUsefulRate_hz;
  double best = 0;
  for (const double rate : mode.rates_hz)
    if (best == 0 || std::abs(rate - target_hz) < std::abs(best - target_hz)) best = rate;
  return best;
}

bool may_read(const CameraMode& mode, const V4l2Options& options) {
  return mode.readable && (!options.format || mode.format == to_string(*options.format));
}

/// The mode's size that is nearest to the requested one.
std::pair<int, int> nearest_size(const CameraMode& mode, std::pair<int, int> wanted) {
  if (!mode.largest) return {mode.width, mode.height};
  return {std::clamp(wanted.first, std::min(mode.min_width, mode.width), mode.width),
          std::clamp(wanted.second, std::min(mode.min_height, mode.height), mode.height)};
}

}  // namespace

std::string fourcc_name(std::uint32_t fourcc) {
  std::string name;
  for (int i = 0; i < 4; ++i) {
    const auto character = static_cast<unsigned char>((fourcc >> (8 * i)) & 0x7fU);
    name += std::isprint(character) != 0 ? static_cast<char>(character) : '?';
  }
  return name;
}

std::uint32_t fourcc_of(PixelFormat format) {
  switch (format) {
    case PixelFormat::Grey:
      return V4L2_PIX_FMT_GREY;
    case PixelFormat::Nv12:
      return V4L2_PIX_FMT_NV12;
    case PixelFormat::Yuyv:
      return V4L2_PIX_FMT_YUYV;
    case PixelFormat::Uyvy:
      return V4L2_PIX_FMT_UYVY;
    case PixelFormat::Mjpg:
      return V4L2_PIX_FMT_MJPEG;
  }
  return 0;
}

Result<CameraDevice> read_capabilities(int device, const std::string& path) {
  v4l2_capability capability{};
  if (const int error = control_device(device, VIDIOC_QUERYCAP, &capability); error != 0) {
    Error failure = device_error(path, "not a camera", error);
    if (failure.hint.empty()) failure.hint = "List the cameras of this computer with `waymark cameras`.";
    return tl::unexpected(failure);
  }
  const auto text = [](const auto& bytes) { return std::string(reinterpret_cast<const char*>(bytes)); };
  CameraDevice described{.path = path,
                         .by_id = by_id_of(path),
                         .card = text(capability.card),
                         .driver = text(capability.driver),
                         .bus = text(capability.bus_info)};
  const bool own = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0;
  const std::uint32_t can = own ? capability.device_caps : capability.capabilities;
  if ((can & V4L2_CAP_VIDEO_CAPTURE) != 0 && (can & V4L2_CAP_STREAMING) != 0) return described;
  const bool planes = (can & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0;
  return fail(ErrorCode::Unsupported,
              planes ? "the device delivers only multi-planar images" : "the device delivers no images",
              {.source = path},
              planes ? "Use GStreamer for ribbon-cable cameras: gstreamer:libcamerasrc."
                     : "Many cameras have a second node for other data: use the node before it.");
}

std::vector<CameraMode> read_modes(int device) {
  std::vector<CameraMode> modes;
  for (std::uint32_t i = 0; i < kMaxEntries; ++i) {
    v4l2_fmtdesc entry{};
    entry.index = i;
    entry.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (control_device(device, VIDIOC_ENUM_FMT, &entry) != 0) break;
    read_sizes(device, entry.pixelformat, modes);
  }
  return modes;
}

Result<WantedMode> choose_mode(const std::vector<CameraMode>& modes, const V4l2Options& options,
                               const WantedMode& now) {
  const bool given = options.width > 0;
  const auto size = given ? std::pair(options.width, options.height) : std::pair(now.width, now.height);
  const auto rank = [&](const WantedMode& mode) {
    const double target_hz = options.rate_hz > 0 ? options.rate_hz : kUsefulRate_hz;
    const int apart_px = std::abs(mode.width - size.first) + std::abs(mode.height - size.second);
    return std::tuple(apart_px, std::abs(mode.rate_hz - target_hz), work_of(mode.format));
  };
  std::optional<WantedMode> best;
  for (const CameraMode& mode : modes) {
    if (!may_read(mode, options)) continue;
    const auto [width, height] = nearest_size(mode, size);
    if (given && std::pair(width, height) != size) continue;
    const WantedMode wanted{*pixel_format_named(mode.format), width, height,
                            best_rate(mode, options.rate_hz)};
    if (!best || rank(wanted) < rank(*best)) best = wanted;
  }
  if (best) return *best;
  const std::string sized = given ? fmt::format(" of {} x {} px", size.first, size.second) : std::string();
  const std::string format = options.format ? fmt::format(" as {}", to_string(*options.format)) : "";
  return fail(ErrorCode::Unsupported,
              fmt::format("the camera delivers no supported images{}{}", sized, format),
              {.source = options.device}, modes.empty() ? "Its driver lists no formats." : modes_text(modes));
}

}  // namespace waymark::internal
