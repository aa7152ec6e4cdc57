#include "waymark/app/localize/localize_robot.hpp"

#include <filesystem>
#include <utility>

#include "waymark/app/common/estimate_message.hpp"
#include "waymark/app/common/fresh_file.hpp"
#include "waymark/app/common/stopwatch.hpp"
#include "waymark/app/live/live_robot.hpp"
#include "waymark/app/live/robot_kinds.hpp"
#include "waymark/app/live/session_viewers.hpp"
#include "waymark/app/localize/localize_output.hpp"
#include "waymark/recording/map_markers.hpp"

namespace waymark {
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

}  // namespace waymark
