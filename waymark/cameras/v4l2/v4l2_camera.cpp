#include "waymark/cameras/v4l2/v4l2_camera.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/base/message_text.hpp"
#include "waymark/cameras/v4l2/capture_thread.hpp"
#include "waymark/cameras/v4l2/controls.hpp"
#include "waymark/cameras/v4l2/device.hpp"
#include "waymark/cameras/v4l2/device_list.hpp"
#include "waymark/cameras/v4l2/images.hpp"

namespace waymark {
namespace {

constexpr Duration kRepeat = std::chrono::seconds(10);  // interval between reports of damaged images

/// A message about controls in automatic mode that affect measurements.
std::optional<std::string> automatic_text(const std::vector<CameraControl>& controls) {
  std::vector<std::string> names;
  for (const CameraControl& control : controls)
    if (control.automatic) names.push_back(control.name);
  if (names.empty()) return std::nullopt;
  return fmt::format("the camera adjusts {} automatically; append ',lock' to its address to keep the values",
                     fmt::join(names, ", "));
}

/// A message if the camera's rate differs from the requested one.
std::optional<std::string> rate_text(double asked_hz, double rate_hz) {
  constexpr double kTolerance = 0.02;  // 29.97 Hz counts as 30 Hz
  if (asked_hz <= 0 || rate_hz <= 0 || std::abs(rate_hz / asked_hz - 1) < kTolerance) return std::nullopt;
  return fmt::format(
      "requested {:.4g} Hz, but the camera delivers {:.4g} Hz in this size and format (`waymark cameras` "
      "lists "
      "the rates)",
      asked_hz, rate_hz);
}

}  // namespace

struct V4l2Camera::Impl {
  Impl(std::shared_ptr<internal::CaptureStream> stream, const V4l2Options& with)
      : options(with),
        about(fmt::format("{}, {} x {} px, {}{}", stream->card(), stream->layout().width,
                          stream->layout().height, to_string(stream->layout().format),
                          stream->rate_hz() > 0 ? fmt::format(", {:.4g} Hz", stream->rate_hz()) : "")),
        thread(std::move(stream), with, by_id_of(with.device)) {}

  void report_if(const std::optional<std::string>& report) {
    if (report) reports.push_back(*report);
  }
  /// Reports the first damaged image and then, at most every `kRepeat`, the number of damaged images since
  /// the last report.
  void note_damaged(const std::string& why, Duration now) {
    ++damaged;
    ++damaged_unreported;
    if (damaged_reported && now - *damaged_reported < kRepeat) return;
    damaged_reported = now;
    reports.push_back(fmt::format("skipped {}: {}", counted(damaged_unreported, "damaged image"), why));
    damaged_unreported = 0;
  }
  std::optional<CameraFrame> convert(const internal::TakenImage& captured);
  [[nodiscard]] std::optional<std::string> next_report();

  V4l2Options options;
  std::string about;
  internal::CaptureThread thread;
  internal::ImageStamps stamps{};
  internal::ImageFaults faults{};
  std::deque<std::string> reports{};
  std::optional<std::pair<std::uint32_t, std::optional<Duration>>>
      taken{};  ///< number and stamp of the previous image
  std::optional<SensorTime> last{};
  std::uint64_t delivered = 0;
  std::uint64_t damaged = 0;
  std::uint64_t damaged_unreported = 0;
  std::optional<Duration> damaged_reported{};
};

std::optional<CameraFrame> V4l2Camera::Impl::convert(const internal::TakenImage& captured) {
  const internal::FilledBuffer& buffer = captured.buffer;
  const bool counted =
      !taken || (buffer.sequence != taken->first && (!buffer.stamp || buffer.stamp > taken->second));
  taken = {buffer.sequence, buffer.stamp};
  const auto stamped =
      stamps.add(buffer.stamp, buffer.start_of_exposure, captured.exposure, captured.arrived);
  Result<Image> image =
      buffer.damaged ? Result<Image>(fail(ErrorCode::Unreadable, "reported as incomplete by the driver"))
                     : to_grey(buffer.bytes, captured.stream->layout());
  captured.stream->give_back(buffer.index);
  report_if(stamps.take_reports());
  if (!image) {
    note_damaged(image.error().message, captured.arrived);
    return std::nullopt;
  }
  report_if(faults.add(*image, stamped.stamp, counted));
  ++delivered;
  last = SensorTime(stamped.stamp);
  return CameraFrame{.stamp = *last, .camera = options.name, .image = std::move(*image)};
}

std::optional<std::string> V4l2Camera::Impl::next_report() {
  if (reports.empty()) return thread.take_reports();
  std::string first = std::move(reports.front());
  reports.pop_front();
  return first;
}

V4l2Camera::V4l2Camera(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
V4l2Camera::~V4l2Camera() = default;

Result<std::unique_ptr<V4l2Camera>> V4l2Camera::open(const V4l2Options& options) {
  auto stream = internal::CaptureStream::open(options);
  if (!stream) return tl::unexpected(stream.error());
  const double rate_hz = (*stream)->rate_hz();
  std::unique_ptr<V4l2Camera> camera(new V4l2Camera(std::make_unique<Impl>(std::move(*stream), options)));
  camera->impl_->report_if(rate_text(options.rate_hz, rate_hz));
  camera->impl_->report_if(automatic_text(camera->controls()));
  return camera;
}

Result<std::optional<RobotEvent>> V4l2Camera::next(Duration timeout) {
  const Duration deadline = steady_now() + timeout;
  while (true) {
    if (auto report = impl_->next_report()) return std::optional<RobotEvent>(RobotText{std::move(*report)});
    const auto captured = impl_->thread.take(std::max(Duration(0), deadline - steady_now()));
    if (captured) {
      auto frame = impl_->convert(*captured);
      if (frame) return std::optional<RobotEvent>(Sample(std::move(*frame)));
    } else if (const auto why = impl_->thread.ended()) {
      return tl::unexpected(*why);
    }
    if (steady_now() >= deadline && !more()) return std::optional<RobotEvent>();
  }
}

bool V4l2Camera::more() const { return !impl_->reports.empty() || impl_->thread.more(); }

std::optional<SensorTime> V4l2Camera::now() const {
  return impl_->last ? std::optional(SensorTime(steady_now())) : std::nullopt;
}

CameraCounts V4l2Camera::counts() const {
  CameraCounts counts = impl_->thread.counts();
  counts.delivered = impl_->delivered;
  counts.damaged = impl_->damaged;
  return counts;
}

std::string V4l2Camera::description() const { return impl_->about; }

std::vector<CameraControl> V4l2Camera::controls() {
  const auto stream = impl_->thread.stream();
  return stream != nullptr ? internal::read_controls(stream->number()) : std::vector<CameraControl>();
}

Status V4l2Camera::set_control(const std::string& name, double value) {
  const auto stream = impl_->thread.stream();
  if (stream == nullptr)
    return fail(ErrorCode::Unwritable, "the camera is unplugged", {.source = impl_->options.device});
  Status set = internal::write_control(stream->number(), impl_->options.device, name, value);
  if (set) impl_->thread.exposure_changed();
  return set;
}

}  // namespace waymark
