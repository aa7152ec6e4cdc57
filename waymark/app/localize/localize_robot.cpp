#include "waymark/app/localize/localize_robot.hpp"

#include <filesystem>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/common/estimate_message.hpp"
#include "waymark/app/common/output_files.hpp"
#include "waymark/app/live/live_robot.hpp"
#include "waymark/app/live/robot_kinds.hpp"
#include "waymark/app/live/viewers.hpp"
#include "waymark/app/localize/localize_output.hpp"
#include "waymark/recording/ros2/map_markers.hpp"

namespace waymark {
namespace {

constexpr const char* kPhase = "localizing";

/// Shows the estimates to viewers and receives their requests.
class LocalizeViewers {
 public:
  LocalizeViewers(const RobotSetup& setup, const LocalizeRobotJob& job, const TagMap& tags)
      : feed_(job.feed) {
    if (feed_ == nullptr) return;
    SessionViewers viewers(feed_);
    viewers.show_camera(setup.simulated);
    std::error_code ignored;
    const std::filesystem::path map = job.map;
    viewers.show_map(std::filesystem::is_directory(map, ignored) ? map : map.parent_path());
    feed_->show_shapes(map_markers(tags, {}));
    publish_status();
  }

  void show(const LocalizationEstimate& estimate) {
    if (feed_ == nullptr) return;
    if (estimate.certain) feed_->publish(estimate_message(estimate), host_now_ns());
    if (certain_ == estimate.certain) return;
    certain_ = estimate.certain;
    publish_status();
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
        if (order.kind == Kind::Message) request.messages.push_back(std::move(order.message));
      }
      return request;
    };
  }

 private:
  void publish_status() { feed_->set_status({.phase = kPhase, .commands = {"stop"}, .certain = certain_}); }

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
          .on_message = control.note};
}

/// A job for reading calibration, map and start pose in the same way as for a recording.
LocalizeJob filter_job(const LocalizeRobotJob& job) {
  return {.map = job.map,
          .calibration = job.calibration,
          .tag_size_m = job.tag_size_m,
          .start = job.start,
          .method = job.method,
          .filter = job.filter,
          .asked = job.asked,
          .anchor = job.anchor};
}

LocalizeSessionOptions session_options(const LocalizeRobotJob& job) {
  LocalizeSessionOptions options{
      .report_every = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(job.every_s))};
  if (job.duration_s > 0) options.most_s = job.duration_s;
  return options;
}

Status check_job(const LocalizeRobotJob& job) {
  if (job.image_settings.in_strips && job.image_settings.search_every <= 1)
    return fail(ErrorCode::InvalidArgument, kSearchedWholly, {.key = "search_strips"}, kSearchEvery);
  if (Status valid = check_recorded_images(job.images, job.output); !valid) return valid;
  if (Status valid = check_localize_output(job.output); !valid) return valid;
  if (job.method != LocalizationKind::Smoother || job.filter.lag_s > 0) return {};
  return fail(ErrorCode::InvalidArgument, "a smoother needs a maximum delay on a running robot",
              {.key = "lag_s"}, "Set `lag_s`, for example to 2, or `method=riekf`.");
}

/// Adds the values that LocalizeOutput does not provide.
void complete(LocalizeReport& report, LocalizationKind method, Localizer& localizer) {
  report.method = method;
  report.problems = localizer.method().problems();
  if (const RiekfLocalizer* filter = localizer.filter()) report.lasting_nis = filter->tracker().lasting_nis();
}

}  // namespace

Result<RobotSetup> load_listening_robot(const LocalizeRobotJob& job) {
  if (Status valid = check_job(job); !valid) return tl::unexpected(valid.error());
  std::error_code ignored;
  const std::filesystem::path map = job.map;
  const auto folder = std::filesystem::is_directory(map, ignored) ? map : map.parent_path();
  auto setup = load_kind(job.robot, {}, job.robot_file.empty() ? robot_file_in(folder) : job.robot_file, 1);
  if (!setup) {
    std::vector<std::string> kinds = robot_kind_names(true);
    kinds.erase(kinds.begin());  // another program cannot drive the simulated robot
    return fail(ErrorCode::InvalidArgument, fmt::format("unknown robot '{}'", job.robot), {.key = "robot"},
                fmt::format("Known: {}.", fmt::join(kinds, ", ")));
  }
  if (!*setup) return std::move(*setup);
  if (Status added = add_live_cameras(job.camera_sources, **setup); !added)
    return tl::unexpected(added.error());
  (*setup)->image_settings = job.image_settings;
  (*setup)->process.listen_only = true;
  if (!(*setup)->process.words.empty()) (*setup)->process.words.emplace_back("--listen-only");
  return std::move(*setup);
}

Result<LocalizeRobotReport> localize_robot(const RobotSetup& setup, const LocalizeRobotJob& job,
                                           const JobControl& control) {
  const Stopwatch watch;
  if (Status status = check_job(job); !status) return tl::unexpected(status.error());
  const LocalizeJob reading = filter_job(job);
  const Result<LocalizeInputs> inputs = read_localize_inputs(reading, setup.robot(), setup.robot_yaml);
  if (!inputs) return tl::unexpected(inputs.error());
  for (const std::string& warning : inputs->warnings) control.note("warning: " + warning);
  Result<Localizer> localizer = Localizer::make(inputs->setup);
  if (!localizer) return tl::unexpected(localizer.error());
  start_localizer(reading, *localizer);
  // The output is opened before the robot starts, so that no drive is wasted if the file cannot be written.
  Result<LocalizeOutput> output = LocalizeOutput::open(job.output, inputs->setup,
                                                       {.name = "process:" + setup.process.text(),
                                                        .map = job.map,
                                                        .live = true,
                                                        .images = job.images,
                                                        .robot_yaml = setup.robot_yaml,
                                                        .cameras = setup.simulated.cameras()});
  if (!output) return tl::unexpected(output.error());
  FreshFile fresh(job.output);
  LocalizeViewers viewers(setup, job, inputs->setup.tags);
  RobotSetup known = setup;
  if (!inputs->setup.tags.tags.empty()) {
    known.simulated.world.tags = inputs->setup.tags;
    known.simulated.world.anchor = inputs->setup.tags.tags.begin()->first;
  }
  const auto robot = LiveRobot::open(known, control);
  if (!robot) return tl::unexpected(robot.error());
  LocalizeSession session(std::move(*localizer), listener_of(job, *output, viewers, fresh, control),
                          viewers.requests(), session_options(job));
  const auto driven = (*robot)->drive(watched(session.listener(), job.feed, control));
  Status status = driven ? Status() : tl::unexpected(driven.error());
  for (const LocalizationEstimate& estimate : session.localizer().smoothed())
    if (status) status = output->on_estimate(estimate);
  Result<LocalizeReport> report = output->close(!status);  // closed even if the drive failed
  if (!status) return tl::unexpected(status.error());
  if (!report) return tl::unexpected(report.error());
  // Discard a table without rows.
  if (report->estimates == 0 && !job.output.ends_with(".mcap")) fresh.discard();
  complete(*report, job.method, session.localizer());
  report->wall_s = watch.seconds();
  return LocalizeRobotReport{std::move(*report), session.end(*driven)};
}

}  // namespace waymark
