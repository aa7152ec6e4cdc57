#include "waymark/app/live/cameras.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <optional>
#include <string_view>
#include <utility>
#include <variant>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/common/camera_description.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/cameras/gstreamer/gstreamer_camera.hpp"
#include "waymark/cameras/v4l2/v4l2_camera.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {

bool is_camera_address(std::string_view word) {
  return word.starts_with(kV4l2Scheme) || word.starts_with(kGstreamerScheme);
}

Result<bool> is_only_camera(const std::vector<std::string>& sources) {
  const bool live = sources.size() == 1 && is_camera_address(sources.front());
  if (!live && std::ranges::any_of(sources, is_camera_address))
    return fail(ErrorCode::InvalidArgument, "a live camera must be the only input", {},
                "Run the program once for each camera.");
  return live;
}

Result<bool> are_cameras(const std::vector<std::string>& sources) {
  const bool live = !sources.empty() && std::ranges::all_of(sources, is_camera_address);
  if (!live && std::ranges::any_of(sources, is_camera_address))
    return fail(ErrorCode::InvalidArgument, "live cameras and files cannot be combined", {},
                "Run the program once for the files, and once for the cameras.");
  for (auto source = sources.begin(); live && source != sources.end(); ++source)
    if (std::find(sources.begin(), source, *source) != source)
      return fail(ErrorCode::InvalidArgument, "duplicate camera", {.key = *source}, "Name each camera once.");
  return live;
}

Result<CameraAddress> parse_camera_address(const std::string& word, const std::string& name) {
  const std::size_t sign = word.find('=');
  const bool named = !is_camera_address(word) && sign != std::string::npos;
  CameraAddress camera{named ? word.substr(0, sign) : name, named ? word.substr(sign + 1) : word};
  if (is_camera_address(camera.address) && !camera.name.empty()) return camera;
  return fail(ErrorCode::InvalidArgument, "invalid camera address", {.key = word},
              "For example v4l2:/dev/video0 or left=v4l2:/dev/video2; `waymark cameras` lists them.");
}

Result<std::unique_ptr<LiveCamera>> open_live_camera(const std::string& address, const std::string& name) {
  if (!is_camera_address(address))
    return fail(ErrorCode::InvalidArgument, "invalid camera address", {.key = address},
                "For example v4l2:/dev/video0; `waymark cameras` lists them.");
  if (address.starts_with(kGstreamerScheme)) {
    auto camera = GstreamerCamera::open(address.substr(kGstreamerScheme.size()), name);
    if (!camera) return tl::unexpected(camera.error());
    return std::unique_ptr<LiveCamera>(std::move(*camera));
  }
  auto options = parse_v4l2_address(address);
  if (!options) return tl::unexpected(options.error());
  options->name = name;
  auto camera = V4l2Camera::open(*options);
  if (!camera) return tl::unexpected(camera.error());
  return std::unique_ptr<LiveCamera>(std::move(*camera));
}

namespace {

constexpr std::array<std::string_view, 4> kMainControls = {"exposure_ms", "gain", "focus", "white_balance_k"};

std::string mode_text(const CameraMode& mode) {
  std::vector<std::string> rates;
  rates.reserve(mode.rates_hz.size());
  for (const double rate : mode.rates_hz) rates.push_back(fmt::format("{:.4g}", rate));
  return fmt::format("  {:<5} {:>5} x {:<5} {}{}{}\n", mode.format, mode.width, mode.height,
                     mode.largest
                         ? fmt::format("and any size down to {} x {} ", mode.min_width, mode.min_height)
                         : std::string(),
                     rates.empty() ? "" : fmt::format("{} Hz", fmt::join(rates, ", ")),
                     mode.readable ? "" : "  (not supported by waymark)");
}

std::string control_text(const CameraControl& control) {
  std::string words;
  const double entry = control.value - control.min;  // drivers may report values that are not in the menu
  if (entry >= 0 && entry < static_cast<double>(control.words.size()))
    words = fmt::format(" ({})", printable(control.words[static_cast<std::size_t>(entry)]));
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
    if (all_controls || std::ranges::find(kMainControls, control.name) != kMainControls.end())
      text += control_text(control);
  return text;
}

}  // namespace

Result<CamerasReport> find_cameras(const CamerasJob& job) {
  if (job.device.empty()) return CamerasReport{list_cameras()};
  auto one = describe_camera(job.device);
  if (!one) return tl::unexpected(one.error());
  return CamerasReport{{std::move(*one)}};
}

std::string to_text(const CamerasReport& report, bool controls) {
  std::string text;
  for (const CameraDevice& device : report.cameras) text += device_text(device, controls);
  return text;
}

ReportFields fields(const CameraMode& mode) {
  const auto of_largest = [&](int size_px) { return mode.largest ? std::optional(size_px) : std::nullopt; };
  return {{"format", "Pixel format, such as YUYV", mode.format},
          {"readable", "Whether Waymark can read this format", mode.readable},
          {"width_px", "Width; the largest one if the device supports any size", mode.width},
          {"height_px", "Height; the largest one if the device supports any size", mode.height},
          {"rates_hz", "Frame rates, highest first; empty: not reported by the driver", mode.rates_hz},
          {"least_width_px", "Smallest width; present only if the device supports any size",
           if_any(of_largest(mode.min_width))},
          {"least_height_px", "Smallest height; present only if the device supports any size",
           if_any(of_largest(mode.min_height))}};
}

ReportFields fields(const CameraControl& control) {
  const auto words = control.words.empty() ? std::nullopt : std::optional(control.words);
  return {{"name", "Name with unit, such as exposure_ms, else the driver's name", control.name},
          {"value", "Current value", control.value},
          {"min", "Smallest value", control.min},
          {"max", "Largest value", control.max},
          {"step", "Step between values", control.step},
          {"default", "Default of the driver", control.preset},
          {"automatic", "Whether the camera sets the value automatically", control.automatic},
          {"writable", "Whether the value can be set, either now or after automatic mode is switched off",
           control.writable},
          {"words", "Names of the values, starting at min; present only for a menu", if_any(words)}};
}

ReportFields fields(const CameraDevice& device) {
  return {{"path", "Device, such as /dev/video0", device.path},
          {"by_id", "Link that does not depend on the USB port; may be empty", device.by_id},
          {"card", "Name of the camera", device.card},
          {"driver", "Name of its driver", device.driver},
          {"bus", "Connection to the computer", device.bus},
          {"in_use_by", "Program that uses the device; empty: unknown or none", device.holder},
          {"modes", "One entry per format and size", device.modes},
          {"controls", "One entry per control", device.controls},
          {"problem", "Why the device cannot be used; present only in that case", if_any(device.problem)}};
}

ReportFields fields(const CamerasReport& report) {
  return {{"cameras", "One entry per device", report.cameras}};
}

namespace {

constexpr Duration kMinJump = std::chrono::milliseconds(50);  // slewing adjusts a clock by less than this per
                                                              // second
constexpr int kTries = 5;

}  // namespace

SystemClocks system_clocks() {
  return {.steady = steady_now, .system = [] {
            return std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch());
          }};
}

SystemStamps::SystemStamps(SystemClocks clocks)
    : clocks_(std::move(clocks)), difference_(measured()), latest_(difference_) {}

/// The offset determined by the pair of readings that took the shortest time.
Duration SystemStamps::measured() const {
  Duration best{};
  Duration least = Duration::max();
  for (int i = 0; i < kTries; ++i) {
    const Duration before = clocks_.steady();
    const Duration system = clocks_.system();
    const Duration after = clocks_.steady();
    if (after - before >= least) continue;
    least = after - before;
    best = system - before - least / 2;
  }
  return best;
}

std::optional<std::string> SystemStamps::take_jump() {
  const Duration now = measured();
  const Duration jump = now - std::exchange(latest_, now);
  if (std::chrono::abs(jump) < kMinJump) return std::nullopt;
  return fmt::format("this computer's clock was set {} by {:.3f} s; stamps are not affected",
                     jump > Duration(0) ? "forward" : "back", std::abs(to_seconds(jump)));
}

namespace {

constexpr Duration kWatchSlice = std::chrono::milliseconds(100);
constexpr Duration kClockPeriod = std::chrono::seconds(1);
constexpr Duration kCameraSilence = std::chrono::seconds(10);

/// A single run of watch_camera().
class Watcher {
 public:
  Watcher(LiveCamera& camera, const TagFinder& finder, const CameraWatch& watch)
      : camera_(camera), finder_(finder), watch_(watch), last_event_(stamps_.now()) {}

  Result<CameraWatchEnd> run() {
    while (!over()) {
      const Result<bool> stepped = step();
      if (!stepped) return tl::unexpected(stepped.error());
    }
    end_.counts = camera_.counts();
    if (first_) end_.seconds = to_seconds(last_ - *first_);
    return end_;
  }

 private:
  [[nodiscard]] bool over() {
    end_.stopped = watch_.should_stop();
    return end_.stopped || camera_.ended() || (first_ && to_seconds(last_ - *first_) >= watch_.duration_s);
  }

  Result<bool> step() {
    check_clock();
    auto event = camera_.next(kWatchSlice);
    if (!event) return tl::unexpected(event.error());
    if (!*event) return silent();
    last_event_ = stamps_.now();
    if (const auto* text = std::get_if<RobotText>(&**event)) watch_.on_message(text->text);
    auto* sample = std::get_if<Sample>(&**event);
    auto* frame = sample != nullptr ? std::get_if<CameraFrame>(sample) : nullptr;
    if (frame == nullptr) return true;
    const Status seen = take(std::move(*frame));
    return seen ? Result<bool>(true) : tl::unexpected(seen.error());
  }

  Result<bool> silent() const {
    if (stamps_.now() - last_event_ < kCameraSilence) return true;
    return fail(ErrorCode::Unreadable, "the camera delivers no images", {.source = camera_.description()},
                "Check its cable; `waymark cameras` lists the connected cameras.");
  }

  Status take(CameraFrame frame) {
    frame.stamp = stamps_.at(frame.stamp);
    const ImageView view = frame.image;
    if (watch_.lens.known())
      if (Status fits = check_image_size(*watch_.lens.camera(), view.width, view.height); !fits) return fits;
    auto found = find_tags(view, finder_, watch_.lens);
    if (!found) return tl::unexpected(found.error());
    CameraImage seen{std::move(frame), std::move(*found), {}};
    seen.age = stamps_.now() - seen.frame.stamp;
    if (!first_) first_ = seen.frame.stamp;
    last_ = seen.frame.stamp;
    ++end_.images;
    end_.tags += seen.found.detections.size();
    end_.unreliable += count_unreliable(seen.found.detections);
    end_.no_tags.add(seen.frame.image, seen.found.detections.size() + seen.found.beyond_lens);
    return watch_.on_image(seen);
  }

  void check_clock() {
    if (stamps_.now() < next_check_) return;
    next_check_ = stamps_.now() + kClockPeriod;
    if (const auto jump = stamps_.take_jump()) watch_.on_message(*jump);
  }

  LiveCamera& camera_;
  const TagFinder& finder_;
  const CameraWatch& watch_;
  SystemStamps stamps_{};
  SensorTime last_event_;
  SensorTime next_check_{};
  std::optional<SensorTime> first_{};
  SensorTime last_{};
  CameraWatchEnd end_{};
};

}  // namespace

std::string no_tags_note(const CameraWatchEnd& end, const TagFinder& finder) {
  const auto reason = end.no_tags.reason(finder.tracking.detector);
  return reason ? "note: " + reason->message : std::string();
}

Result<CameraWatchEnd> watch_camera(LiveCamera& camera, const TagFinder& finder, const CameraWatch& watch) {
  return Watcher(camera, finder, watch).run();
}

}  // namespace waymark
