#include "waymark/cameras/v4l2/controls.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <string_view>

#include <linux/videodev2.h>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"
#include "waymark/cameras/v4l2/device.hpp"

namespace waymark::internal {
namespace {

constexpr double kExposureUnit_ms = 0.1;  // unit of V4L2_CID_EXPOSURE_ABSOLUTE
constexpr std::int64_t kMaxControls = 64;

/// A control that affects measurements, the control that sets its automatic mode, and the value of the latter
/// for manual mode.
struct MeasuringControl {
  const char* name;
  std::uint32_t id;
  double unit;
  std::uint32_t auto_id;
  std::int32_t manual;
};
constexpr std::array kMeasuringControls = {
    MeasuringControl{"exposure_ms", V4L2_CID_EXPOSURE_ABSOLUTE, kExposureUnit_ms, V4L2_CID_EXPOSURE_AUTO,
                     V4L2_EXPOSURE_MANUAL},
    MeasuringControl{"gain", V4L2_CID_GAIN, 1, V4L2_CID_AUTOGAIN, 0},
    MeasuringControl{"focus", V4L2_CID_FOCUS_ABSOLUTE, 1, V4L2_CID_FOCUS_AUTO, 0},
    MeasuringControl{"white_balance_k", V4L2_CID_WHITE_BALANCE_TEMPERATURE, 1, V4L2_CID_AUTO_WHITE_BALANCE,
                     0},
};

const MeasuringControl* measuring_control(std::uint32_t id) {
  const auto found = std::ranges::find(kMeasuringControls, id, &MeasuringControl::id);
  return found == kMeasuringControls.end() ? nullptr : &*found;
}

/// "Power Line Frequency" becomes "power_line_frequency", as in v4l2-ctl.
std::string plain_name(const char* title) {
  std::string name;
  for (const char* c = title; *c != '\0'; ++c) {
    const auto character = static_cast<unsigned char>(*c);
    if (std::isalnum(character) != 0)
      name += static_cast<char>(std::tolower(character));
    else if (!name.empty() && name.back() != '_')
      name += '_';
  }
  while (name.ends_with('_')) name.pop_back();
  return name;
}

std::optional<std::int32_t> value_of(int device, std::uint32_t id) {
  v4l2_control control{};
  control.id = id;
  if (control_device(device, VIDIOC_G_CTRL, &control) != 0) return std::nullopt;
  return control.value;
}

/// Whether the camera sets the control automatically. Aperture priority (the common automatic mode of
/// webcams) counts as automatic exposure; shutter priority does not, because the user sets the exposure time.
bool is_automatic(int device, const MeasuringControl& control) {
  const auto mode = value_of(device, control.auto_id);
  if (!mode) return false;
  if (control.auto_id == V4L2_CID_EXPOSURE_AUTO)
    return *mode == V4L2_EXPOSURE_AUTO || *mode == V4L2_EXPOSURE_APERTURE_PRIORITY;
  return *mode != control.manual;
}

std::vector<std::string> menu_entries(int device, const v4l2_queryctrl& query) {
  std::vector<std::string> entries;
  const auto last = std::min<std::int64_t>(query.maximum, query.minimum + kMaxControls);
  for (std::int64_t i = query.minimum; i <= last; ++i) {
    v4l2_querymenu entry{};
    entry.id = query.id;
    entry.index = static_cast<std::uint32_t>(i);
    const bool there = control_device(device, VIDIOC_QUERYMENU, &entry) == 0;
    entries.emplace_back(there ? reinterpret_cast<const char*>(entry.name) : "");
  }
  return entries;
}

bool is_plain(const v4l2_queryctrl& query) {
  return (query.flags & V4L2_CTRL_FLAG_DISABLED) == 0 &&
         (query.type == V4L2_CTRL_TYPE_INTEGER || query.type == V4L2_CTRL_TYPE_BOOLEAN ||
          query.type == V4L2_CTRL_TYPE_MENU);
}

/// The driver's controls, ordered by id.
std::vector<v4l2_queryctrl> query_controls(int device) {
  std::vector<v4l2_queryctrl> all;
  v4l2_queryctrl query{};
  query.id = V4L2_CTRL_FLAG_NEXT_CTRL;
  while (all.size() < 1024 && control_device(device, VIDIOC_QUERYCTRL, &query) == 0) {
    const std::uint32_t id = query.id;
    if (is_plain(query)) all.push_back(query);
    query = {};
    query.id = id | V4L2_CTRL_FLAG_NEXT_CTRL;
  }
  return all;
}

CameraControl describe(int device, const v4l2_queryctrl& query) {
  const MeasuringControl* measuring = measuring_control(query.id);
  const double unit = measuring != nullptr ? measuring->unit : 1;
  CameraControl control{
      .name = measuring != nullptr ? measuring->name : plain_name(reinterpret_cast<const char*>(query.name)),
      .value = unit * value_of(device, query.id).value_or(query.default_value),
      .min = unit * query.minimum,
      .max = unit * query.maximum,
      .step = unit * std::max(1, query.step),
      .preset = unit * query.default_value,
      .automatic = measuring != nullptr && is_automatic(device, *measuring),
      .writable = (query.flags & (V4L2_CTRL_FLAG_READ_ONLY | V4L2_CTRL_FLAG_GRABBED)) == 0};
  if (query.type == V4L2_CTRL_TYPE_MENU) control.words = menu_entries(device, query);
  return control;
}

Status set_value(int device, const std::string& source, const std::string& name, std::uint32_t id,
                 std::int32_t value) {
  v4l2_control control{};
  control.id = id;
  control.value = value;
  const int error = control_device(device, VIDIOC_S_CTRL, &control);
  if (error == 0) return {};
  Error failure = device_error(source, "cannot set the control", error);
  failure.code = ErrorCode::Unwritable;
  failure.place.key = name;
  return tl::unexpected(failure);
}

Status switch_to_manual(int device, const std::string& source, const MeasuringControl& control) {
  if (!is_automatic(device, control)) return {};
  return set_value(device, source, control.name, control.auto_id, control.manual);
}

}  // namespace

std::vector<CameraControl> read_controls(int device) {
  std::vector<CameraControl> controls;
  for (const v4l2_queryctrl& query : query_controls(device)) controls.push_back(describe(device, query));
  return controls;
}

Status write_control(int device, const std::string& source, const std::string& name, double value) {
  std::vector<std::string> names;
  for (const v4l2_queryctrl& query : query_controls(device)) {
    const CameraControl control = describe(device, query);
    names.push_back(control.name);
    if (control.name != name) continue;
    if (value < control.min || value > control.max)
      return fail(ErrorCode::InvalidArgument, fmt::format("{:g} is outside the range of this control", value),
                  {.source = source, .key = name},
                  fmt::format("Set a value from {:g} to {:g}.", control.min, control.max));
    const MeasuringControl* measuring = measuring_control(query.id);
    if (measuring != nullptr)
      if (Status manual = switch_to_manual(device, source, *measuring); !manual) return manual;
    const double unit = measuring != nullptr ? measuring->unit : 1;
    return set_value(device, source, name, query.id, static_cast<std::int32_t>(std::lround(value / unit)));
  }
  return fail(ErrorCode::InvalidArgument, "the camera has no such control", {.source = source, .key = name},
              suggestion(name, names));
}

Status lock_controls(int device, const std::string& source) {
  for (const MeasuringControl& control : kMeasuringControls)
    if (Status manual = switch_to_manual(device, source, control); !manual) return manual;
  return {};
}

std::optional<Duration> exposure_of(int device) {
  const auto units = value_of(device, V4L2_CID_EXPOSURE_ABSOLUTE);
  if (!units || *units <= 0) return std::nullopt;
  return std::chrono::microseconds(100) * std::int64_t{*units};
}

}  // namespace waymark::internal
