#include "waymark/app/doctor/computer_checks.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <system_error>
#include <thread>
#include <vector>

#include <unistd.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/common/shell_word.hpp"
#include "waymark/app/doctor/robot_checks.hpp"
#include "waymark/app/live/cameras.hpp"
#include "waymark/base/order_statistics.hpp"
#include "waymark/base/random.hpp"
#include "waymark/config/exchange/camera_file.hpp"
#include "waymark/config/yaml/calibration_file.hpp"
#include "waymark/families/family.hpp"
#include "waymark/robots/limo/serial_port.hpp"
#include "waymark/robots/watchdog/device_file.hpp"
#include "waymark/robots/watchdog/pipes.hpp"
#include "waymark/runtime/robot_loop.hpp"

namespace waymark {
namespace {

constexpr double kOldDays = 180;
constexpr std::uint64_t kMinFree_bytes = 200'000'000;
constexpr std::uint64_t kSome_bytes = 2'000'000'000;
constexpr double kMaxShare = 0.5;  // the rest is reserved for mapping, the page and other programs
constexpr double kNoCore = 0.9;
constexpr Duration kLook = std::chrono::seconds(1);
constexpr Duration kFirst = std::chrono::seconds(5);  // some cameras take seconds to deliver the first image

constexpr const char* kCalibrate = "waymark calibrate camera help=true";

DoctorLine check_device(const CameraDevice& device) {
  DoctorLine line{.key = "camera", .message = fmt::format("{}: {}", device.path, device.card)};
  const auto readable = std::ranges::count_if(device.modes, &CameraMode::readable);
  if (device.problem) {
    line.level = DoctorLevel::Fail;
    line.message = fmt::format("{}: {}", device.path, device.problem->message);
    line.command = device.problem->hint;
  } else if (readable == 0) {
    line.level = DoctorLevel::Fail;
    line.message += " has no supported format";
    line.command = fmt::format("gst-launch-1.0 v4l2src device={} ! fakesink", device.path);
  } else if (!device.holder.empty()) {
    line.level = DoctorLevel::Warn;
    line.message += " is used by " + device.holder;
    line.command = fmt::format("fuser -v {}", device.path);
  } else {
    line.message += fmt::format(", {} formats and sizes", readable);
  }
  return line;
}

std::string unobservable_in(const Calibration& calibration) {
  std::string names;
  for (const auto& [name, value] : calibration.values)
    if (value.verdict == CalibrationVerdict::Unobservable) names += (names.empty() ? "" : ", ") + name;
  return names;
}

}  // namespace

const char* to_string(DoctorLevel level) {
  constexpr std::array kWords = {"ok", "warn", "fail"};
  return kWords[static_cast<std::size_t>(level)];
}

std::vector<DoctorLine> check_cameras(const std::vector<CameraDevice>& devices) {
  std::vector<DoctorLine> lines;
  lines.reserve(std::max<std::size_t>(1, devices.size()));
  for (const CameraDevice& device : devices) lines.push_back(check_device(device));
  if (lines.empty())
    lines.push_back({"camera", DoctorLevel::Warn, "this computer has no camera; the robot may have its own",
                     "waymark cameras"});
  return lines;
}

std::string flat_image_warning(const ImageView& image) {
  constexpr std::size_t kEvery = 4;     // stride in pixels, for speed
  constexpr double kOutliers = 0.0005;  // fraction of the pixels that is ignored at either end
  constexpr double kDark = 40;
  std::vector<double> levels;
  for (int y = 0; y < image.height; ++y)
    for (std::size_t x = static_cast<std::size_t>(y) % kEvery; x < static_cast<std::size_t>(image.width);
         x += kEvery)
      levels.push_back(image.row(y)[x]);
  if (levels.empty()) return {};
  const double low = quantile(levels, kOutliers);
  const double high = quantile(std::move(levels), 1 - kOutliers);
  if (high - low >= DetectorOptions{}.min_white_black_diff) return {};
  return fmt::format(
      "; the grey levels of its last image are only {:.0f} to {:.0f}, too little contrast for a tag: {}", low,
      high,
      high < kDark ? "is the lens covered, or the exposure too short?"
                   : "is the exposure too long, or the lens close to a wall?");
}

DoctorLine check_live_camera(const std::string& address, const DoctorCancelled& cancelled) {
  DoctorLine line{.key = "camera", .message = address};
  const auto failed = [&](const Error& error) {
    line.level = DoctorLevel::Fail;
    line.message = to_string(error);
    line.command = "waymark cameras";
    return line;
  };
  const auto camera = open_live_camera(address);
  if (!camera) return failed(camera.error());
  std::string messages;
  std::string flat;
  int images = 0;
  SensorTime first{};
  SensorTime last{};
  Duration end = steady_now() + kFirst;
  while (steady_now() < end && !(*camera)->ended() && !cancelled()) {
    const auto event = (*camera)->next(std::chrono::milliseconds(100));
    if (!event) return failed(event.error());
    if (!*event) continue;
    if (const auto* text = std::get_if<RobotText>(&**event)) messages += "; " + text->text;
    if (const auto* sample = std::get_if<Sample>(&**event)) {
      last = stamp_of(*sample);
      if (const auto* frame = std::get_if<CameraFrame>(sample))
        flat = flat_image_warning(frame->image.view());
      if (images++ == 0) {
        first = last;
        end = steady_now() + kLook;
      }
    }
  }
  const bool silent = images < 2;
  if (!silent) messages += flat;
  const bool warns = silent || !messages.empty();
  line.level = silent ? DoctorLevel::Fail : warns ? DoctorLevel::Warn : DoctorLevel::Ok;
  line.message =
      (*camera)->description() +
      (silent ? std::string(" delivers no images")
              : fmt::format(" delivers {:.1f} images per second", (images - 1) / to_seconds(last - first))) +
      messages;
  if (warns) line.command = "waymark detect " + shell_word(address) + " view=true";
  return line;
}

DoctorLine check_calibration(const std::filesystem::path& path, std::filesystem::file_time_type now) {
  DoctorLine line{.key = "calibration", .level = DoctorLevel::Warn, .command = kCalibrate};
  std::error_code error;
  const auto written = std::filesystem::last_write_time(path, error);
  const auto calibration = read_calibration(path);
  const auto camera = calibration ? Result<NamedCamera>(fail(ErrorCode::NotFound, "")) : read_camera(path);
  if (error || (!calibration && !camera)) {
    line.level = DoctorLevel::Fail;
    line.message = to_string(camera ? Error{ErrorCode::NotFound, error.message()} : camera.error());
    return line;
  }
  const double days = std::chrono::duration<double>(now - written).count() / 86400;
  const std::string unobservable = calibration ? unobservable_in(*calibration) : std::string();
  line.message = fmt::format("{}: {:.0f} days old", path.string(), std::max(0.0, days));
  if (!calibration)
    line.message += ", without uncertainties";
  else if (!calibration->camera)
    line.message += ", without a camera calibration";
  else if (!unobservable.empty())
    line.message += ", not observable: " + unobservable;
  else if (days > kOldDays)
    line.message += ": calibrate again if the lens was touched since then";
  else
    line = {.key = "calibration", .message = line.message + ", all parameters observable"};
  return line;
}

DoctorLine check_disk(const std::filesystem::path& folder) {
  std::error_code error;
  if (std::filesystem::exists(folder, error) && !std::filesystem::is_directory(folder, error))
    return {"disk", DoctorLevel::Fail, fmt::format("{}: not a folder", folder.string()),
            "ls -ld " + shell_word(folder.string())};
  if (std::filesystem::exists(folder, error) && access(folder.c_str(), W_OK) != 0)
    return {"disk", DoctorLevel::Fail,
            fmt::format("{}: not writable: {}", folder.string(), std::generic_category().message(errno)),
            "ls -ld " + shell_word(folder.string())};
  const std::filesystem::space_info space = std::filesystem::space(folder, error);
  if (!error) return check_disk(folder, space.available);
  return {"disk", DoctorLevel::Fail, fmt::format("{}: {}", folder.string(), error.message()), "df -h"};
}

DoctorLine check_disk(const std::filesystem::path& folder, std::uint64_t free_bytes) {
  const double gigabytes = static_cast<double>(free_bytes) * 1e-9;
  DoctorLine line{.key = "disk", .message = fmt::format("{:.1f} GB free at {}", gigabytes, folder.string())};
  if (free_bytes >= kSome_bytes) return line;
  line.level = free_bytes < kMinFree_bytes ? DoctorLevel::Fail : DoctorLevel::Warn;
  line.command = fmt::format("du -sh {}/* | sort -h | tail", folder.string());
  return line;
}

namespace {

DoctorLevel level_of(const LoopTrialResult& result) {
  const bool late = result.dropped * 10 > result.images || result.share > kNoCore || result.images == 0;
  return late ? DoctorLevel::Fail : result.share > kMaxShare ? DoctorLevel::Warn : DoctorLevel::Ok;
}

}  // namespace

DoctorLine check_processor(const LoopTrial& trial, const LoopTrialResult& result) {
  DoctorLine line{
      .key = "processor",
      .level = level_of(result),
      .message = fmt::format("detection in {} x {} px at {:g} Hz needs {:.0f} % of one core, {:.1f} ms per "
                             "image; {} of {} images skipped",
                             trial.width, trial.height, trial.rate_hz, 100 * result.share, result.median_ms,
                             result.dropped, result.images)};
  if (line.level != DoctorLevel::Ok)
    line.command = fmt::format("waymark doctor rate_hz={:g}", trial.rate_hz / 2);
  return line;
}

namespace {

std::vector<std::string> gamepads() {
  std::vector<std::string> found;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/dev/input", error))
    if (entry.path().filename().string().starts_with("js")) found.push_back(entry.path().string());
  std::ranges::sort(found);
  return found;
}

/// Adds one line that lists the devices of a kind, and one for each device that the user may not open.
void add_kind(const std::string& key, const std::string& what, const std::vector<std::string>& paths,
              std::vector<DoctorLine>& lines) {
  if (paths.empty()) return;
  const std::size_t before = lines.size();
  for (const std::string& path : paths) {
    if (::access(path.c_str(), R_OK | W_OK) == 0) continue;
    const Error error = no_permission(path, what, "ls -l " + path);
    lines.push_back({key, DoctorLevel::Warn, path + ": " + error.message, error.hint});
  }
  if (lines.size() == before)
    lines.push_back({key, DoctorLevel::Ok, fmt::format("{} can be opened", fmt::join(paths, ", ")), ""});
}

}  // namespace

std::vector<DoctorLine> check_devices() {
  std::vector<DoctorLine> lines;
  add_kind("serial", "the serial port", list_serial_ports(), lines);
  add_kind("gamepad", "the gamepad", gamepads(), lines);
  return lines;
}

namespace {

constexpr double kNoise = 3;  // standard deviation in grey levels, as for a webcam indoors

/// Draws a tag with its white border; its cells have `cell_px` pixels per side.
void draw_tag(Image& image, int id, int left, int top, int cell_px) {
  const std::vector<std::uint8_t> cells = bitmap({FamilyId::Tag36h11, id});
  const int side = static_cast<int>(std::lround(std::sqrt(static_cast<double>(cells.size()))));
  for (int y = 0; y < side * cell_px; ++y)
    for (int x = 0; x < side * cell_px; ++x) {
      const int cell = (y / cell_px) * side + x / cell_px;
      image.row(top + y)[left + x] = cells[static_cast<std::size_t>(cell)] != 0 ? 200 : 40;
    }
}

/// Four tags on a textured background, with noise.
Image drawn_image(int width, int height) {
  Image image(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      image.row(y)[x] = static_cast<std::uint8_t>(120 + 30 * std::sin(x / 17.0) * std::cos(y / 23.0));
  const int cell_px = std::max(1, std::min(width, height) / 40);
  const int side = 10 * cell_px;
  for (int i = 0; i < 4; ++i)
    draw_tag(image, i, (i % 2 == 0 ? width / 4 : 3 * width / 4) - side / 2,
             (i < 2 ? height / 4 : 3 * height / 4) - side / 2, cell_px);
  Random random(1);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      image.row(y)[x] =
          static_cast<std::uint8_t>(std::clamp(image.row(y)[x] + random.normal(0, kNoise), 0.0, 255.0));
  return image;
}

/// Delivers the same image repeatedly, at a fixed rate.
class DrawnCamera final : public Source {
 public:
  explicit DrawnCamera(const LoopTrial& trial)
      : image_(drawn_image(trial.width, trial.height)),
        period_(static_cast<std::int64_t>(1e9 / trial.rate_hz)),
        due_(steady_now() + period_) {}

  Result<std::optional<RobotEvent>> next(Duration most) override {
    const Duration wait = due_ - steady_now();
    if (wait > most) {
      std::this_thread::sleep_for(most);
      return std::optional<RobotEvent>();
    }
    if (wait > Duration(0)) std::this_thread::sleep_for(wait);
    const CameraFrame frame{.stamp = SensorTime(due_), .image = image_};
    due_ += period_;
    return std::optional<RobotEvent>(Sample(frame));
  }
  [[nodiscard]] bool more() const override { return steady_now() >= due_; }
  [[nodiscard]] std::optional<SensorTime> now() const override { return SensorTime(steady_now()); }

 private:
  Image image_;
  Duration period_;
  Duration due_;
};

class StandingRobot final : public Robot {
 public:
  Status command(const VelocityCommand& /*command*/) override { return {}; }
};

double thread_seconds() {
  timespec used{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
  return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}

}  // namespace

Result<LoopTrialResult> try_loop(const TagFinder& finder, const LoopTrial& trial,
                                 const DoctorCancelled& cancelled) {
  DrawnCamera source(trial);
  StandingRobot robot;
  RobotLoop loop(source, robot, real_time(), {.finder = &finder}, {.timeout_s = trial.seconds});
  std::vector<double> delays_ms;
  RobotListener listener;
  listener.on_sample = [&](const Sample& sample) {
    if (std::holds_alternative<TagFrame>(sample))
      delays_ms.push_back(1e3 * to_seconds(steady_now() - stamp_of(sample).time_since_epoch()));
    return Status();
  };
  listener.should_stop = cancelled;
  listener.decide = [](Duration, SensorTime) { return Result<DriverDecision>(DriverDecision{}); };
  const double began_s = thread_seconds();
  const auto end = loop.drive(listener);
  if (!end) return tl::unexpected(end.error());
  LoopTrialResult result{.images = static_cast<int>(delays_ms.size()) + loop.dropped_images(),
                         .dropped = loop.dropped_images(),
                         .share = (thread_seconds() - began_s) / to_seconds(end->uptime)};
  std::ranges::sort(delays_ms);
  if (!delays_ms.empty()) result.median_ms = delays_ms[delays_ms.size() / 2];
  return result;
}

}  // namespace waymark
