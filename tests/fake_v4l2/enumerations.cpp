#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "tests/fake_v4l2/fake_device.hpp"

namespace fake_v4l2 {
namespace {

struct ControlRow {
  std::uint32_t id;
  std::uint32_t type;
  const char* name;
  std::int32_t min, max, step, preset;
};
// The controls of a common webcam with uvcvideo: exposure by aperture priority.
constexpr std::array kControls = {
    ControlRow{V4L2_CID_BRIGHTNESS, V4L2_CTRL_TYPE_INTEGER, "Brightness", -64, 64, 1, 0},
    ControlRow{V4L2_CID_AUTO_WHITE_BALANCE, V4L2_CTRL_TYPE_BOOLEAN, "White Balance, Automatic", 0, 1, 1, 1},
    ControlRow{V4L2_CID_GAIN, V4L2_CTRL_TYPE_INTEGER, "Gain", 0, 100, 1, 10},
    ControlRow{V4L2_CID_POWER_LINE_FREQUENCY, V4L2_CTRL_TYPE_MENU, "Power Line Frequency", 0, 2, 1, 1},
    ControlRow{V4L2_CID_WHITE_BALANCE_TEMPERATURE, V4L2_CTRL_TYPE_INTEGER, "White Balance Temperature", 2800,
               6500, 1, 4600},
    ControlRow{V4L2_CID_EXPOSURE_AUTO, V4L2_CTRL_TYPE_MENU, "Auto Exposure", 0, 3, 1, 3},
    ControlRow{V4L2_CID_EXPOSURE_ABSOLUTE, V4L2_CTRL_TYPE_INTEGER, "Exposure Time, Absolute", 3, 2047, 1,
               100},
};

template <std::size_t N>
void copy_text(__u8 (&to)[N], const std::string& text) {
  std::memset(to, 0, N);
  std::memcpy(to, text.data(), std::min(text.size(), N - 1));
}

const ControlRow* row_of(std::uint32_t id) {
  const auto found = std::ranges::find(kControls, id, &ControlRow::id);
  return found == kControls.end() ? nullptr : &*found;
}

int capability(v4l2_capability& capability, const std::string& card) {
  capability = {};
  copy_text(capability.driver, "fakevideo");
  copy_text(capability.card, card);
  copy_text(capability.bus_info, "usb-fake-1.2");
  capability.device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING | V4L2_CAP_EXT_PIX_FORMAT;
  capability.capabilities = capability.device_caps | V4L2_CAP_DEVICE_CAPS;
  capability.version = 0x060100;
  return 0;
}

/// Formats in the order of their first mode.
std::vector<std::uint32_t> formats_of(const std::vector<Mode>& modes) {
  std::vector<std::uint32_t> formats;
  for (const Mode& mode : modes)
    if (std::ranges::find(formats, mode.fourcc) == formats.end()) formats.push_back(mode.fourcc);
  return formats;
}

int format_at(v4l2_fmtdesc& entry, const std::vector<Mode>& modes) {
  const auto formats = formats_of(modes);
  if (entry.type != V4L2_BUF_TYPE_VIDEO_CAPTURE || entry.index >= formats.size()) return EINVAL;
  entry.pixelformat = formats[entry.index];
  entry.flags = entry.pixelformat == V4L2_PIX_FMT_MJPEG ? V4L2_FMT_FLAG_COMPRESSED : 0;
  copy_text(entry.description, "fake");
  return 0;
}

int size_at(v4l2_frmsizeenum& entry, const std::vector<Mode>& modes) {
  std::uint32_t index = 0;
  for (const Mode& mode : modes) {
    if (mode.fourcc != entry.pixel_format || index++ != entry.index) continue;
    entry.type = V4L2_FRMSIZE_TYPE_DISCRETE;
    entry.discrete = {mode.width, mode.height};
    return 0;
  }
  return EINVAL;
}

int interval_at(v4l2_frmivalenum& entry, const std::vector<Mode>& modes) {
  for (const Mode& mode : modes) {
    if (mode.fourcc != entry.pixel_format || mode.width != entry.width || mode.height != entry.height)
      continue;
    if (entry.index > 0) return EINVAL;
    entry.type = V4L2_FRMIVAL_TYPE_DISCRETE;
    entry.discrete = {1000, static_cast<std::uint32_t>(std::lround(1000 * mode.rate_hz))};
    return 0;
  }
  return EINVAL;
}

}  // namespace

int Device::query_control(v4l2_queryctrl& query) const {
  if (!about_.controls) return EINVAL;
  const bool next = (query.id & V4L2_CTRL_FLAG_NEXT_CTRL) != 0;
  const std::uint32_t id = query.id & ~(V4L2_CTRL_FLAG_NEXT_CTRL | V4L2_CTRL_FLAG_NEXT_COMPOUND);
  const auto found = std::ranges::find_if(
      kControls, [&](const ControlRow& row) { return next ? row.id > id : row.id == id; });
  if (found == kControls.end()) return EINVAL;
  query = {};
  query.id = found->id;
  query.type = found->type;
  copy_text(query.name, found->name);
  query.minimum = found->min;
  query.maximum = found->max;
  query.step = found->step;
  query.default_value = found->preset;
  return 0;
}

int Device::query_menu(v4l2_querymenu& menu) const {
  constexpr std::array kExposure = {"Auto Mode", "Manual Mode", "Shutter Priority Mode",
                                    "Aperture Priority Mode"};
  constexpr std::array kPower = {"Disabled", "50 Hz", "60 Hz", ""};
  const ControlRow* row = row_of(menu.id);
  const bool exposure = menu.id == V4L2_CID_EXPOSURE_AUTO;
  if (row == nullptr || row->type != V4L2_CTRL_TYPE_MENU || menu.index > static_cast<unsigned>(row->max))
    return EINVAL;
  if (exposure && menu.index != V4L2_EXPOSURE_MANUAL && menu.index != V4L2_EXPOSURE_APERTURE_PRIORITY)
    return EINVAL;
  __u8 name[sizeof menu.name];  // the structure is packed
  copy_text(name, (exposure ? kExposure : kPower)[menu.index]);
  std::memcpy(static_cast<void*>(&menu.name), name, sizeof name);
  return 0;
}

int Device::control(v4l2_control& control, bool set) {
  const ControlRow* row = about_.controls ? row_of(control.id) : nullptr;
  if (row == nullptr) return EINVAL;
  const auto value = values_.find(control.id);
  if (!set) {
    control.value = value == values_.end() ? row->preset : value->second;
    return 0;
  }
  // Like uvcvideo: the exposure cannot be set while it is automatic.
  const auto mode = values_.find(V4L2_CID_EXPOSURE_AUTO);
  const bool manual = mode != values_.end() && mode->second == V4L2_EXPOSURE_MANUAL;
  if (control.id == V4L2_CID_EXPOSURE_ABSOLUTE && !manual) return EIO;
  if (control.value < row->min || control.value > row->max) return ERANGE;
  values_[control.id] = control.value;
  return 0;
}

int Device::enumerate(unsigned long request, void* argument) const {
  switch (static_cast<std::uint32_t>(request)) {
    case VIDIOC_QUERYCAP:
      return capability(*static_cast<v4l2_capability*>(argument), about_.card);
    case VIDIOC_ENUM_FMT:
      return format_at(*static_cast<v4l2_fmtdesc*>(argument), about_.modes);
    case VIDIOC_ENUM_FRAMESIZES:
      return size_at(*static_cast<v4l2_frmsizeenum*>(argument), about_.modes);
    case VIDIOC_ENUM_FRAMEINTERVALS:
      return interval_at(*static_cast<v4l2_frmivalenum*>(argument), about_.modes);
    case VIDIOC_ENUMINPUT: {
      auto& input = *static_cast<v4l2_input*>(argument);
      if (input.index != 0) return EINVAL;
      input = {};
      copy_text(input.name, "Camera 1");
      input.type = V4L2_INPUT_TYPE_CAMERA;
      return 0;
    }
    case VIDIOC_G_INPUT:
      *static_cast<int*>(argument) = 0;
      return 0;
    case VIDIOC_S_INPUT:
      return 0;
    default:
      return ENOTTY;
  }
}

}  // namespace fake_v4l2
