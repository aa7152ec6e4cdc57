#include "waymark/app/localize/localize_live.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/app/common/camera_tags.hpp"
#include "waymark/app/common/estimate_message.hpp"
#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/json_line.hpp"
#include "waymark/app/common/output_files.hpp"
#include "waymark/app/live/cameras.hpp"
#include "waymark/app/live/live_robot.hpp"
#include "waymark/app/live/robot_kinds.hpp"
#include "waymark/app/live/viewers.hpp"
#include "waymark/app/localize/localize_output.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/config/exchange/landmarks_file.hpp"
#include "waymark/geometry/dense.hpp"
#include "waymark/recording/ros2/map_markers.hpp"
#include "waymark/samples/mounted_camera.hpp"

namespace waymark {

// What is localised.
namespace {

LocalizeInput kind_of(const LocalizeJob& job, bool calibrated) {
  if (is_robot_kind(job.robot)) return LocalizeInput::Robot;
  if (std::ranges::any_of(job.logs, is_camera_address)) return LocalizeInput::Camera;
  const auto filmed = [&](const std::string& log) { return is_of_camera(log, calibrated); };
  return std::ranges::any_of(job.logs, filmed) ? LocalizeInput::Video : LocalizeInput::Recording;
}

}  // namespace

Result<LocalizeInput> localize_kind(const LocalizeJob& job, bool calibrated) {
  const LocalizeInput input = kind_of(job, calibrated);
  const bool robot = input == LocalizeInput::Robot;
  if (robot && !job.logs.empty())
    return fail(ErrorCode::InvalidArgument,
                "a robot that is there is localised, and a recording is named, too",
                {.source = job.logs.front()}, "Leave one of them out; --robot NAME describes a robot.");
  if (input == LocalizeInput::Camera && job.logs.size() > 1)
    return fail(ErrorCode::InvalidArgument, "a live camera is the only input", {},
                "Run the program once for each camera.");
  if (input == LocalizeInput::Video && job.logs.size() > 1)
    return fail(ErrorCode::InvalidArgument, "a video is the only input", {.source = job.logs[1]},
                "Run the program once for each video.");
  if (!robot && job.logs.empty())
    return fail(ErrorCode::InvalidArgument, "there is nothing to localise", {},
                "Name a recording, or a robot that is there: --robot ros2:limo.");
  return input;
}

Result<LocalizeInput> localize_input(const LocalizeJob& job, const GivenFlags& given) {
  const Result<LocalizeInput> input = localize_kind(job, given("--camera"));
  if (!input) return input;
  const bool robot = *input == LocalizeInput::Robot;
  const bool camera = *input == LocalizeInput::Camera;
  const bool video = *input == LocalizeInput::Video;
  const char* leave_out = "Leave it out.";
  FlagRefusals refused(given);
  refused.flags(!robot,
                {"--robot-file", "--camera-source", "--detector", "--search-every", "--search-strips"},
                "this is about a robot that is there", "Add --robot KIND:ADDRESS.");
  refused.flags(!given("--search-every"), {"--search-strips"}, kSearchedWholly, kSearchEvery);
  refused.flags(!robot && !camera, {"--duration-s", "--record-images", "--view", "--publish-ros2"},
                "this is about a robot or a camera that is there", leave_out);
  refused.flags(*input == LocalizeInput::Recording, {"--every-s"},
                "this is about a robot, a camera or a video", leave_out);
  refused.flags(!camera && !video, {"--camera", "--camera-name", "--camera-size"},
                "this is about a live camera or a video", "--robot describes a robot's camera.");
  refused.flags(!video, {"--readout-ms"}, "this is about a video",
                "For a robot's camera it is --set filter.camera_readout_s=0.015.");
  refused.flags(*input != LocalizeInput::Recording,
                {"--no-adapt", "--base-frame", "--camera-frame", "--camera-topic", "--odometry-topic",
                 "--imu-topic", "--sensor-pose"},
                "this is about recordings", leave_out);
  refused.flags(camera || video, {"--robot", "--calibration", "--start", "--method"},
                "a camera without a robot is where the tags of one picture say", leave_out);
  refused.flags((robot || camera) && job.output.empty(), {"--record-images"}, "nothing is recorded",
                "Add -o FILE.mcap.");
  if (!refused.status()) return tl::unexpected(refused.status().error());
  return input;
}

// Lines about where it is.
namespace {

/// The largest standard deviation of the position [m].
double position_sigma_m(const Uncertain<SE3>& pose) {
  const Eigen::Matrix3d position = coordinate_covariance(pose).topLeftCorner<3, 3>();
  return std::sqrt(symmetric_eigen<3>(position).values.maxCoeff());
}

}  // namespace

std::string estimate_line(double since_s, const std::optional<LocalizationEstimate>& estimate) {
  if (!estimate)
    return fmt::format("{:8.1f} s: not known: no tags of the map were seen, or the robot is silent\n",
                       since_s);
  const SE2& pose = estimate->map_T_base;
  return fmt::format(
      "{:8.1f} s: x {:.3f} m, y {:.3f} m, heading {:.1f} deg, within {:.3f} m and {:.2f} deg{}\n", since_s,
      pose.x(), pose.y(), to_degrees(pose.yaw()), estimate->position_sigma_m(),
      to_degrees(std::sqrt(estimate->covariance(2, 2))), estimate->certain ? "" : ", a guess");
}

std::string estimate_json(SensorTime now, const std::optional<LocalizationEstimate>& estimate) {
  nlohmann::ordered_json json{{"now_s", to_seconds(now.time_since_epoch())}, {"pose", nullptr}};
  if (!estimate) return json_line(json);
  const SE2& pose = estimate->map_T_base;
  json["pose"] = {{"stamp_s", to_seconds(estimate->stamp.time_since_epoch())},
                  {"x_m", pose.x()},
                  {"y_m", pose.y()},
                  {"yaw_rad", pose.yaw()},
                  {"position_sigma_m", estimate->position_sigma_m()},
                  {"yaw_sigma_rad", std::sqrt(estimate->covariance(2, 2))},
                  {"certain", estimate->certain}};
  return json_line(json);
}

std::string moment_line(double since_s, const CameraMoment& moment) {
  if (!moment.map_T_body)
    return fmt::format("{:8.1f} s: not known, {}\n", since_s,
                       moment.tags == 0 ? "no tags were seen" : moment.why);
  const SE3& pose = moment.map_T_body->mean;
  const Eigen::Vector3d& at = pose.translation();
  const Eigen::Vector3d rpy = pose.rotation().rpy();
  return fmt::format(
      "{:8.1f} s: x {:.3f} m, y {:.3f} m, z {:.3f} m, roll {:.1f} deg, pitch {:.1f} deg, yaw {:.1f} deg, "
      "within {:.3f} m by {} tags\n",
      since_s, at.x(), at.y(), at.z(), to_degrees(rpy.x()), to_degrees(rpy.y()), to_degrees(rpy.z()),
      position_sigma_m(*moment.map_T_body), moment.tags);
}

std::string moment_json(const CameraMoment& moment) {
  nlohmann::ordered_json json{{"stamp_s", to_seconds(moment.stamp.time_since_epoch())},
                              {"age_ms", 1e3 * to_seconds(moment.age)},
                              {"tags", moment.tags},
                              {"pose", nullptr}};
  if (!moment.map_T_body) {
    json["why"] = moment.why;
    return json_line(json);
  }
  const Eigen::Vector3d& at = moment.map_T_body->mean.translation();
  const Eigen::Quaterniond& q = moment.map_T_body->mean.rotation().quaternion();
  json["pose"] = {{"position_m", {at.x(), at.y(), at.z()}},
                  {"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}},
                  {"position_sigma_m", position_sigma_m(*moment.map_T_body)}};
  return json_line(json);
}

void MomentLines::take(const CameraMoment& moment) {
  if (!first_) first_ = next_ = moment.stamp;
  if (moment.stamp < next_) return;
  next_ = moment.stamp + every_;
  print_(json_ ? moment_json(moment) : moment_line(to_seconds(moment.stamp - *first_), moment));
}

// A camera.
namespace {

/// What is shown and recorded of the pictures.
class CameraLog {
 public:
  CameraLog(const LocalizeCameraJob& job, const TagMap& map, LocalizeOutput& output)
      : job_(job), moments_(map, job.camera), output_(output), fresh_(job.localize.output) {
    if (job.feed == nullptr) return;
    job.feed->show_camera(job.camera, base_T_camera({}));
    job.feed->show_shapes(map_markers(map, {}));
  }

  Status take(CameraPicture& seen) {
    const TagFrame tags{seen.frame.stamp, seen.frame.camera, std::move(seen.found.detections)};
    CameraMoment moment = moments_.of(tags);
    moment.age = seen.age;
    fresh_.keep();
    Status status = output_.on_sample(seen.frame);
    if (status) status = output_.on_sample(tags);
    show(seen, tags);
    if (moment.map_T_body) {
      ++known_;
      const auto message = pose_message(moment);
      if (status) status = output_.on_pose(moment.stamp, message);
      if (job_.feed != nullptr) job_.feed->publish(message, host_now_ns());
    }
    job_.on_moment(moment);
    return status;
  }
  [[nodiscard]] std::size_t known() const { return known_; }

 private:
  void show(const CameraPicture& seen, const TagFrame& tags) {
    if (job_.feed == nullptr) return;
    job_.feed->tell({.phase = "localizing"});
    job_.feed->publish(seen.frame, host_now_ns());
    job_.feed->publish(tags, host_now_ns());
  }

  const LocalizeCameraJob& job_;
  LiveMoments moments_;
  LocalizeOutput& output_;
  FreshFile fresh_;
  std::size_t known_ = 0;
};

}  // namespace

Result<LocalizeCameraReport> localize_camera(LiveCamera& camera, const LocalizeCameraJob& job,
                                             const JobControl& control) {
  const Result<LandmarksFile> map = read_landmarks(job.localize.map, job.localize.tag_size_m);
  if (!map) return tl::unexpected(map.error());
  if (Status poses = check_tag_poses(map->tags, job.localize.map); !poses)
    return tl::unexpected(poses.error());
  const auto finder = tag_finder_for(map->tags);
  if (!finder) return tl::unexpected(finder.error());
  Result<LocalizeOutput> output =
      LocalizeOutput::open(job.localize, {},
                           {.name = camera.description(),
                            .live = true,
                            .images = job.images,
                            .cameras = {{.camera = job.camera, .base_T_cam = base_T_camera({})}}});
  if (!output) return tl::unexpected(output.error());
  CameraLog log(job, map->tags, *output);
  CameraWatch watch{.camera = &job.camera,
                    .on_picture = [&](CameraPicture& seen) { return log.take(seen); },
                    .on_words = control.note,
                    .should_stop = control.cancelled};
  if (job.duration_s > 0) watch.duration_s = job.duration_s;
  const auto end = watch_camera(camera, *finder, watch);
  const auto closed = output->close(!end);
  if (!end) return tl::unexpected(end.error());
  if (!closed) return tl::unexpected(closed.error());
  return LocalizeCameraReport{.end = *end, .known = log.known()};
}

// A robot.
namespace {

constexpr const char* kPhase = "localizing";

/// What viewers see of the estimates, and what they ask for.
class LocalizeViewers {
 public:
  LocalizeViewers(const RobotSetup& setup, const LocalizeRobotJob& job, const TagMap& tags)
      : feed_(job.feed) {
    if (feed_ == nullptr) return;
    SessionViewers viewers(feed_);
    viewers.show_camera(setup.simulated);
    std::error_code ignored;
    const std::filesystem::path map = job.localize.map;
    viewers.show_map(std::filesystem::is_directory(map, ignored) ? map : map.parent_path());
    feed_->show_shapes(map_markers(tags, {}));
    tell();
  }

  void show(const LocalizationEstimate& estimate) {
    if (feed_ == nullptr) return;
    if (estimate.certain) feed_->publish(estimate_message(estimate), host_now_ns());
    if (certain_ == estimate.certain) return;
    certain_ = estimate.certain;
    tell();
  }
  void show(const NisRecord& record) {
    if (feed_ != nullptr) feed_->publish(nis_message(record), host_now_ns());
  }

  [[nodiscard]] SessionRequests requests() {
    return [this](Duration) {
      SessionRequest request;
      if (feed_ == nullptr) return request;
      using Kind = ViewerOrder::Kind;
      for (ViewerOrder& order : feed_->take_orders()) {
        request.end = request.end || order.kind == Kind::Stop || order.kind == Kind::Quit;
        if (order.kind == Kind::GivePose) request.pose = order.pose;
        if (order.kind == Kind::Words) request.words.push_back(std::move(order.words));
      }
      return request;
    };
  }

 private:
  void tell() { feed_->tell({.phase = kPhase, .commands = {"stop"}, .certain = certain_}); }

  LiveFeed* feed_;
  std::optional<bool> certain_{};
};

LocalizeListener listener_of(const LocalizeRobotJob& job, LocalizeOutput& output, LocalizeViewers& viewers,
                             FreshFile& fresh, const JobControl& control) {
  return {.on_sample =
              [&](const Sample& sample) {
                fresh.receive(sample);
                return output.on_sample(sample);
              },
          .on_comparison =
              [&](const NisRecord& record) {
                viewers.show(record);
                return output.on_comparison(record);
              },
          .on_estimate =
              [&](const LocalizationEstimate& estimate) {
                viewers.show(estimate);
                return output.on_estimate(estimate);
              },
          .on_report = job.on_report,
          .on_words = control.note};
}

Status check_job(const LocalizeRobotJob& job) {
  if (Status status = check_localize_output(job.localize); !status) return status;
  if (job.localize.method != LocalizationKind::Smoother || job.localize.filter.lag_s > 0) return {};
  return fail(ErrorCode::InvalidArgument, "a smoother of a running robot needs the delay that it may have",
              {.key = "--lag-s"}, "Give --lag-s, for example 2, or --method riekf.");
}

/// What is known after the drive, beside what the output counted.
void complete(LocalizeReport& report, Localizer& localizer) {
  report.problems = localizer.method().problems();
  if (const RiekfLocalizer* filter = localizer.filter()) report.lasting_nis = filter->tracker().lasting_nis();
}

}  // namespace

void only_listen(RobotSetup& setup) {
  setup.process.listen_only = true;
  if (!setup.process.words.empty()) setup.process.words.emplace_back("--listen-only");
}

Result<RobotSetup> load_listening_robot(const std::string& robot, const std::string& robot_file,
                                        const std::filesystem::path& map,
                                        const std::vector<std::string>& camera_sources) {
  std::error_code ignored;
  const auto folder = std::filesystem::is_directory(map, ignored) ? map : map.parent_path();
  std::string file = robot_file;
  if (file.empty()) file = robot_file_in(folder);
  auto setup = load_kind(robot, {}, file, 1);
  if (!setup || !*setup) return setup ? std::move(*setup) : tl::unexpected(Error{});
  if (Status added = add_live_cameras(camera_sources, **setup); !added) return tl::unexpected(added.error());
  only_listen(**setup);
  return std::move(*setup);
}

Result<LocalizeRobotReport> localize_robot(const RobotSetup& setup, const LocalizeRobotJob& job,
                                           const JobControl& control) {
  const Stopwatch watch;
  if (Status status = check_job(job); !status) return tl::unexpected(status.error());
  const Result<LocalizeInputs> inputs = read_localize_inputs(job.localize, setup.robot(), setup.robot_yaml);
  if (!inputs) return tl::unexpected(inputs.error());
  for (const std::string& warning : inputs->warnings) control.note("warning: " + warning);
  Result<Localizer> localizer = Localizer::make(inputs->setup);
  if (!localizer) return tl::unexpected(localizer.error());
  start_localizer(job.localize, *localizer);
  // Before the robot starts: a file that cannot be written should not cost a drive.
  Result<LocalizeOutput> output = LocalizeOutput::open(job.localize, inputs->setup,
                                                       {.name = "process:" + setup.process.text(),
                                                        .live = true,
                                                        .images = job.images,
                                                        .robot_yaml = setup.robot_yaml,
                                                        .cameras = setup.simulated.cameras()});
  if (!output) return tl::unexpected(output.error());
  FreshFile fresh(job.localize.output);
  LocalizeViewers viewers(setup, job, inputs->setup.tags);
  RobotSetup known = setup;
  if (!inputs->setup.tags.tags.empty()) {
    known.simulated.world.tags = inputs->setup.tags;
    known.simulated.world.anchor = inputs->setup.tags.tags.begin()->first;
  }
  const auto robot = LiveRobot::open(known, control);
  if (!robot) return tl::unexpected(robot.error());
  LocalizeSession session(std::move(*localizer), listener_of(job, *output, viewers, fresh, control),
                          viewers.requests(), job.session);
  const auto driven = (*robot)->drive(watched(session.listener(), job.feed, control));
  Status status = driven ? Status() : tl::unexpected(driven.error());
  for (const LocalizationEstimate& estimate : session.localizer().smoothed())
    if (status) status = output->on_estimate(estimate);
  Result<LocalizeReport> report = output->close(!status);  // also of a drive that ended badly
  if (!status) return tl::unexpected(status.error());
  if (!report) return tl::unexpected(report.error());
  if (report->estimates == 0 && !job.localize.output.ends_with(".mcap"))
    fresh.discard();  // a table of nothing
  complete(*report, session.localizer());
  report->wall_s = watch.seconds();
  return LocalizeRobotReport{std::move(*report), session.end(*driven)};
}

// As a user says it.
namespace {

Result<DescribedCamera> camera_of(const LocalizeLive& words) {
  if (words.camera.file.empty())
    return fail(ErrorCode::InvalidArgument, "the calibration of the camera is not known", {.key = "--camera"},
                "`waymark calibrate camera` makes one.");
  return read_camera(words.camera);
}

std::function<void(const CameraMoment&)> lines_of(const LocalizeLive& words, const LocalizeLines& lines) {
  const auto moments = std::make_shared<MomentLines>(words.every_s, lines.json, lines.print);
  return [moments](const CameraMoment& moment) { moments->take(moment); };
}

}  // namespace

LocalizeRobotJob described_robot(const LocalizeLive& words, const LocalizeJob& job,
                                 const LocalizeLines& lines) {
  LocalizeRobotJob live{.localize = job, .images = words.images};
  live.session.report_every =
      std::chrono::duration_cast<Duration>(std::chrono::duration<double>(words.every_s));
  if (words.duration_s > 0) live.session.most_s = words.duration_s;
  live.on_report = [lines, first = std::optional<SensorTime>()](
                       SensorTime now, const std::optional<LocalizationEstimate>& estimate) mutable {
    if (!first) first = now;
    lines.print(lines.json ? estimate_json(now, estimate)
                           : estimate_line(to_seconds(now - *first), estimate));
  };
  return live;
}

Result<LocalizeCameraJob> described_live_camera(const LocalizeLive& words, const LocalizeJob& job,
                                                const LocalizeLines& lines) {
  const Result<DescribedCamera> camera = camera_of(words);
  if (!camera) return tl::unexpected(camera.error());
  return LocalizeCameraJob{.localize = job,
                           .camera = camera->camera,
                           .images = words.images,
                           .duration_s = words.duration_s,
                           .on_moment = lines_of(words, lines)};
}

Result<LocalizeVideoJob> described_video(const LocalizeLive& words, const LocalizeJob& job,
                                         const LocalizeLines& lines) {
  const Result<DescribedCamera> camera = camera_of(words);
  if (!camera) return tl::unexpected(camera.error());
  return LocalizeVideoJob{.localize = job,
                          .camera = camera->camera,
                          .readout_s = camera->readout_s,
                          .on_moment = lines_of(words, lines)};
}

std::string to_text(const LocalizeCameraReport& report) {
  return fmt::format("{} in {:.1f} s, the place known in {}", counted(report.end.pictures, "picture"),
                     report.end.seconds, report.known);
}

std::string to_text(const LocalizeVideoReport& report) {
  return fmt::format("{}, the place known in {}", counted(report.video.pictures, "picture"), report.known);
}

}  // namespace waymark
