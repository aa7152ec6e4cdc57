#include "waymark/cli/localize_camera.hpp"

#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/base/angles.hpp"
#include "waymark/cli/console_control.hpp"
#include "waymark/cli/failure.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/config/camera_file.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/live/camera_address.hpp"
#include "waymark/live/localize_camera.hpp"

namespace waymark::cli {
namespace {

/// The largest standard deviation of the position [m].
double position_sigma_m(const Uncertain<SE3>& pose) {
  const Eigen::Matrix3d position = coordinate_covariance(pose).topLeftCorner<3, 3>();
  return std::sqrt(position.selfadjointView<Eigen::Lower>().eigenvalues().maxCoeff());
}

std::string line_of(double since_s, const CameraMoment& moment) {
  if (!moment.map_T_body)
    return fmt::format("{:8.1f} s: not known, {}\n", since_s,
                       moment.tags == 0 ? "no tags were seen" : "the tags that are seen do not suffice");
  const SE3& pose = moment.map_T_body->mean;
  const Eigen::Vector3d& at = pose.translation();
  const Eigen::Vector3d rpy = pose.rotation().rpy();
  return fmt::format(
      "{:8.1f} s: x {:.3f} m, y {:.3f} m, z {:.3f} m, roll {:.1f} deg, pitch {:.1f} deg, yaw {:.1f} deg, "
      "within "
      "{:.3f} m by {} tags\n",
      since_s, at.x(), at.y(), at.z(), to_degrees(rpy.x()), to_degrees(rpy.y()), to_degrees(rpy.z()),
      position_sigma_m(*moment.map_T_body), moment.tags);
}

std::string json_of(const CameraMoment& moment) {
  nlohmann::ordered_json json{{"stamp_s", to_seconds(moment.stamp.time_since_epoch())},
                              {"age_ms", 1e3 * to_seconds(moment.age)},
                              {"tags", moment.tags},
                              {"pose", nullptr}};
  if (!moment.map_T_body) return json_line(json);
  const Eigen::Vector3d& at = moment.map_T_body->mean.translation();
  const Eigen::Quaterniond& q = moment.map_T_body->mean.rotation().quaternion();
  json["pose"] = {{"position_m", {at.x(), at.y(), at.z()}},
                  {"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}},
                  {"position_sigma_m", position_sigma_m(*moment.map_T_body)}};
  return json_line(json);
}

}  // namespace

ExitCode localize_a_camera(const LocalizeLiveFlags& flags, const LocalizeJob& job, bool json,
                           Console& console) {
  if (flags.camera.empty())
    return console.failed({.code = ErrorCode::InvalidArgument,
                           .message = "the calibration of the camera is not known",
                           .place = {.key = "--camera"},
                           .hint = "`waymark calibrate camera` makes one."},
                          ExitCode::Usage);
  const Result<NamedCamera> calibration = read_camera(flags.camera);
  if (!calibration) return fail_with(calibration.error(), console);
  const auto camera = open_live_camera(job.logs.front());
  if (!camera) return fail_with(camera.error(), console);
  console.say((*camera)->description());
  JobControl control = control_from(console);
  control.cancelled = [&console] { return interrupted() || console.output_ended(); };
  const auto view = start_page(flags.view, (*camera)->description(), console);
  if (!view) return fail_with(view.error(), console);
  std::optional<SensorTime> first;
  SensorTime next{};
  LocalizeCameraJob live{.localize = job,
                         .camera = calibration->camera,
                         .images = flags.images,
                         .duration_s = flags.duration_s,
                         .feed = *view ? &(*view)->feed() : nullptr};
  live.on_moment = [&](const CameraMoment& moment) {
    if (!first) first = next = moment.stamp;
    if (moment.stamp < next) return;
    next = moment.stamp + std::chrono::duration_cast<Duration>(std::chrono::duration<double>(flags.every_s));
    console.print(json ? json_of(moment) : line_of(to_seconds(moment.stamp - *first), moment));
  };
  const auto report = localize_camera(**camera, live, control);
  if (!report) return fail_with(report.error(), console);
  console.say(fmt::format("{} pictures in {:.1f} s, the place known in {}", report->end.pictures,
                          report->end.seconds, report->known));
  if (report->end.stopped && interrupted()) return ExitCode::Interrupted;
  return report->known > 0 ? ExitCode::Ok : ExitCode::SomeFailed;
}

}  // namespace waymark::cli
