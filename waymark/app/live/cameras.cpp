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
#include <nlohmann/json.hpp>

#include "waymark/app/common/camera_description.hpp"
#include "waymark/app/common/report_fields.hpp"
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
    return fail(ErrorCode::InvalidArgument, "a live camera is the only input", {},
                "Run the program once for each camera.");
  return live;
}

Result<bool> are_cameras(const std::vector<std::string>& sources) {
  const bool live = !sources.empty() && std::ranges::all_of(sources, is_camera_address);
  if (!live && std::ranges::any_of(sources, is_camera_address))
    return fail(ErrorCode::InvalidArgument, "live cameras and files are named together", {},
                "Run the program once for the files, and once for the cameras.");
  for (auto source = sources.begin(); live && source != sources.end(); ++source)
    if (std::find(sources.begin(), source, *source) != source)
      return fail(ErrorCode::InvalidArgument, "this camera is named twice", {.source = *source},
                  "Name each camera once.");
  return live;
}

Result<CameraAddress> parse_camera_address(const std::string& word, const std::string& name) {
  const std::size_t sign = word.find('=');
  const bool named = !is_camera_address(word) && sign != std::string::npos;
  CameraAddress camera{named ? word.substr(0, sign) : name, named ? word.substr(sign + 1) : word};
  if (is_camera_address(camera.address) && !camera.name.empty()) return camera;
  return fail(ErrorCode::InvalidArgument, "this is no address of a camera", {.source = word},
              "For example v4l2:/dev/video0 or left=v4l2:/dev/video2; `waymark cameras` lists them.");
}

Result<std::unique_ptr<LiveCamera>> open_live_camera(const std::string& address, const std::string& name) {
  if (!is_camera_address(address))
    return fail(ErrorCode::InvalidArgument, "this is no address of a camera", {.source = address},
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
    if (device.problem) one["problem"] = to_json(fields(*device.problem));
    list.push_back(std::move(one));
  }
  return {{"cameras", std::move(list)}};
}

namespace {

constexpr Duration kJump = std::chrono::milliseconds(50);  // more than a clock is slewed within a second
constexpr int kTries = 5;

}  // namespace

SystemClocks system_clocks() {
  return {.steady = steady_now, .system = [] {
            return std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch());
          }};
}

SystemStamps::SystemStamps(SystemClocks clocks)
    : clocks_(std::move(clocks)), difference_(measured()), latest_(difference_) {}

/// By the pair of readings that took least time.
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
  if (std::chrono::abs(jump) < kJump) return std::nullopt;
  return fmt::format("the clock of this computer was set {} by {:.3f} s; stamps go on as if it had not been",
                     jump > Duration(0) ? "forward" : "back", std::abs(to_seconds(jump)));
}

namespace {

constexpr Duration kWatchSlice = std::chrono::milliseconds(100);
constexpr Duration kClockPeriod = std::chrono::seconds(1);
constexpr Duration kCameraSilence = std::chrono::seconds(10);

/// One run of watch_camera().
class Watcher {
 public:
  Watcher(LiveCamera& camera, const TagFinder& finder, const CameraWatch& watch)
      : camera_(camera), finder_(finder), watch_(watch), last_heard_(stamps_.now()) {}

  Result<CameraWatchEnd> run() {
    while (!over()) {
      const Result<bool> went_on = step();
      if (!went_on) return tl::unexpected(went_on.error());
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
    look_at_clock();
    auto event = camera_.next(kWatchSlice);
    if (!event) return tl::unexpected(event.error());
    if (!*event) return silent();
    last_heard_ = stamps_.now();
    if (const auto* said = std::get_if<RobotText>(&**event)) watch_.on_words(said->text);
    auto* sample = std::get_if<Sample>(&**event);
    auto* frame = sample != nullptr ? std::get_if<CameraFrame>(sample) : nullptr;
    if (frame == nullptr) return true;
    const Status seen = take(std::move(*frame));
    return seen ? Result<bool>(true) : tl::unexpected(seen.error());
  }

  Result<bool> silent() const {
    if (stamps_.now() - last_heard_ < kCameraSilence) return true;
    return fail(ErrorCode::Unreadable, "the camera delivers no pictures", {.source = camera_.description()},
                "Check its cable; `waymark cameras` lists what there is.");
  }

  Status take(CameraFrame frame) {
    frame.stamp = stamps_.at(frame.stamp);
    const ImageView view = frame.image;
    if (watch_.camera != nullptr)
      if (Status fits = check_picture_size(*watch_.camera, view.width, view.height); !fits) return fits;
    auto found = find_tags(view, finder_, watch_.camera);
    if (!found) return tl::unexpected(found.error());
    CameraPicture seen{std::move(frame), std::move(*found), {}};
    seen.age = stamps_.now() - seen.frame.stamp;
    if (!first_) first_ = seen.frame.stamp;
    last_ = seen.frame.stamp;
    ++end_.pictures;
    end_.tags += seen.found.detections.size();
    return watch_.on_picture(seen);
  }

  void look_at_clock() {
    if (stamps_.now() < next_look_) return;
    next_look_ = stamps_.now() + kClockPeriod;
    if (const auto jump = stamps_.take_jump()) watch_.on_words(*jump);
  }

  LiveCamera& camera_;
  const TagFinder& finder_;
  const CameraWatch& watch_;
  SystemStamps stamps_{};
  SensorTime last_heard_;
  SensorTime next_look_{};
  std::optional<SensorTime> first_{};
  SensorTime last_{};
  CameraWatchEnd end_{};
};

}  // namespace

Result<CameraWatchEnd> watch_camera(LiveCamera& camera, const TagFinder& finder, const CameraWatch& watch) {
  return Watcher(camera, finder, watch).run();
}

}  // namespace waymark
