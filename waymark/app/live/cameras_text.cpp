#include "waymark/app/live/cameras_text.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "waymark/app/common/json_line.hpp"
#include "waymark/base/message_text.hpp"

namespace waymark {
namespace {

using nlohmann::ordered_json;

constexpr std::array<std::string_view, 4> kMain = {"exposure_ms", "gain", "focus", "white_balance_k"};

std::string mode_text(const CameraMode& mode) {
  std::vector<std::string> rates;
  rates.reserve(mode.rates_hz.size());
  for (const double rate : mode.rates_hz) rates.push_back(fmt::format("{:.4g}", rate));
  return fmt::format("  {:<5} {:>5} x {:<5} {}{}{}\n", mode.format, mode.width, mode.height,
                     mode.largest
                         ? fmt::format("and any size down to {} x {} ", mode.least_width, mode.least_height)
                         : std::string(),
                     rates.empty() ? "" : fmt::format("{} Hz", fmt::join(rates, ", ")),
                     mode.readable ? "" : "  (not read by waymark)");
}

std::string control_text(const CameraControl& control) {
  std::string words;
  const double place = control.value - control.min;  // a driver may say anything
  if (place >= 0 && place < static_cast<double>(control.words.size()))
    words = fmt::format(" ({})", printable(control.words[static_cast<std::size_t>(place)]));
  return fmt::format("  {} {:g}{}, from {:g} to {:g}{}\n", control.name, control.value, words, control.min,
                     control.max, control.automatic ? ", automatic" : "");
}

std::string device_text(const CameraDevice& device, bool all_controls) {
  if (device.problem)
    return fmt::format("{}: {}. {}\n", device.path, device.problem->message, device.problem->hint);
  std::string text = fmt::format("{}: {} ({}, {})\n", device.path, printable(device.card), device.driver,
                                 printable(device.bus));
  if (!device.by_id.empty()) text += fmt::format("  {}\n", device.by_id);
  if (!device.holder.empty()) text += fmt::format("  in use by {}\n", printable(device.holder));
  for (const CameraMode& mode : device.modes) text += mode_text(mode);
  for (const CameraControl& control : device.controls)
    if (all_controls || std::ranges::find(kMain, control.name) != kMain.end()) text += control_text(control);
  return text;
}

ordered_json mode_json(const CameraMode& mode) {
  ordered_json one{{"format", mode.format},
                   {"readable", mode.readable},
                   {"width_px", mode.width},
                   {"height_px", mode.height},
                   {"rates_hz", mode.rates_hz}};
  if (mode.largest) {
    one["least_width_px"] = mode.least_width;
    one["least_height_px"] = mode.least_height;
  }
  return one;
}

}  // namespace

Result<std::vector<CameraDevice>> find_cameras(const CamerasJob& job) {
  if (job.device.empty()) return list_cameras();
  auto one = describe_camera(job.device);
  if (!one) return tl::unexpected(one.error());
  return std::vector<CameraDevice>{std::move(*one)};
}

std::string to_text(const std::vector<CameraDevice>& devices, bool controls) {
  std::string text;
  for (const CameraDevice& device : devices) text += device_text(device, controls);
  return text;
}

ordered_json to_json(const std::vector<CameraControl>& controls) {
  ordered_json list = ordered_json::array();
  for (const CameraControl& control : controls) {
    ordered_json one{{"name", control.name},
                     {"value", control.value},
                     {"min", control.min},
                     {"max", control.max},
                     {"step", control.step},
                     {"default", control.preset},
                     {"automatic", control.automatic},
                     {"writable", control.writable}};
    if (!control.words.empty()) one["words"] = control.words;
    list.push_back(std::move(one));
  }
  return list;
}

ordered_json to_json(const std::vector<CameraDevice>& devices) {
  ordered_json list = ordered_json::array();
  for (const CameraDevice& device : devices) {
    ordered_json modes = ordered_json::array();
    for (const CameraMode& mode : device.modes) modes.push_back(mode_json(mode));
    ordered_json one{{"path", device.path}, {"by_id", device.by_id},
                     {"card", device.card}, {"driver", device.driver},
                     {"bus", device.bus},   {"in_use_by", device.holder},
                     {"modes", modes},      {"controls", to_json(device.controls)}};
    if (device.problem) one["problem"] = to_json(*device.problem);
    list.push_back(std::move(one));
  }
  return {{"cameras", std::move(list)}};
}

}  // namespace waymark
