#include "waymark/robots/simulated/simulated_lap.hpp"

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "waymark/robots/simulated/detecting_camera.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {
namespace {

constexpr Duration kControlPeriod = std::chrono::milliseconds(50);

}  // namespace

Result<std::optional<RobotEvent>> SimulatedSource::next(Duration /*most*/) {
  if (std::exchange(requests_command_, false)) return std::optional<RobotEvent>(CommandRequest{robot_.now()});
  Sample sample = robot_.next();
  if (robot_.uptime() >= next_request_) {
    next_request_ += kControlPeriod;
    requests_command_ = true;
  }
  if (auto* frame = std::get_if<CameraFrame>(&sample); frame != nullptr && scene_camera_) {
    auto taken = scene_camera_->take(robot_.shot());
    if (!taken) return tl::unexpected(taken.error());
    frame->image = std::move(taken->image);
  }
  return std::optional<RobotEvent>(std::move(sample));
}

namespace {

/// Renders images and detects tags on several threads. Results are returned in the order of the requests, so
/// they do not depend on the number of threads.
class ImageLine {
 public:
  /// Uses one thread per scene camera; with a single camera, no thread is started and pop() does the work.
  explicit ImageLine(std::vector<std::unique_ptr<DetectingCamera>> scene_cameras);
  ~ImageLine();
  ImageLine(const ImageLine&) = delete;
  ImageLine& operator=(const ImageLine&) = delete;

  /// Requests an image. Does not block; the caller must keep pending() small.
  void push(CameraShot shot);
  /// Number of requested images that have not yet been returned by pop().
  [[nodiscard]] std::size_t pending() const { return jobs_.size(); }
  /// Whether pop() would not block.
  [[nodiscard]] bool ready() const;
  /// The oldest image; blocks until it is ready. Requires a pending image.
  [[nodiscard]] Result<SeenImage> pop();

 private:
  struct Job {
    CameraShot shot;
    std::optional<Result<SeenImage>> result{};
    bool taken = false;
  };
  void work(DetectingCamera& scene_camera);

  std::vector<std::unique_ptr<DetectingCamera>> cameras_;
  mutable std::mutex mutex_;
  std::condition_variable work_to_do_;
  std::condition_variable image_done_;
  std::deque<std::shared_ptr<Job>> jobs_;
  bool closing_ = false;
  std::vector<std::thread> threads_;
};

ImageLine::ImageLine(std::vector<std::unique_ptr<DetectingCamera>> scene_cameras)
    : cameras_(std::move(scene_cameras)) {
  if (cameras_.size() < 2) return;
  for (const auto& scene_camera : cameras_)
    threads_.emplace_back([this, &scene_camera] { work(*scene_camera); });
}

ImageLine::~ImageLine() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  work_to_do_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void ImageLine::work(DetectingCamera& scene_camera) {
  std::unique_lock lock(mutex_);
  while (true) {
    const auto waiting = [&] {
      return std::ranges::find(jobs_, false, [](const auto& j) { return j->taken; });
    };
    work_to_do_.wait(lock, [&] { return closing_ || waiting() != jobs_.end(); });
    if (closing_) return;
    const std::shared_ptr<Job> job = *waiting();
    job->taken = true;
    lock.unlock();
    auto seen = scene_camera.detect(job->shot);
    lock.lock();
    job->result = std::move(seen);
    image_done_.notify_all();
  }
}

void ImageLine::push(CameraShot shot) {
  {
    const std::lock_guard lock(mutex_);
    jobs_.push_back(std::make_shared<Job>(Job{.shot = std::move(shot)}));
  }
  work_to_do_.notify_one();
}

bool ImageLine::ready() const {
  const std::lock_guard lock(mutex_);
  return !jobs_.empty() && (threads_.empty() || jobs_.front()->result.has_value());
}

Result<SeenImage> ImageLine::pop() {
  std::unique_lock lock(mutex_);
  const std::shared_ptr<Job> job = jobs_.front();
  if (threads_.empty()) {
    jobs_.pop_front();
    return cameras_.front()->detect(job->shot);
  }
  image_done_.wait(lock, [&] { return job->result.has_value(); });
  jobs_.pop_front();
  return std::move(*job->result);
}

/// Forwards a robot's samples to a listener in order, with a TagFrame for each image.
class SampleLine {
 public:
  /// Creates a scene camera for each thread in the setup; none if there are no images.
  [[nodiscard]] static Result<std::unique_ptr<SampleLine>> make(const SimulatedSetup& setup,
                                                                const LapListener& listener);

  /// Adds a sample and, if it is an image, the shot to render. Forwards samples that are ready; blocks if too
  /// many images are pending.
  [[nodiscard]] Status add(Sample sample, const CameraShot& shot);
  /// Adds a sample that does not come from the robot (a command).
  [[nodiscard]] Status add(Sample sample) { return add(std::move(sample), {}); }
  /// Forwards all pending samples.
  [[nodiscard]] Status finish();

 private:
  SampleLine(std::unique_ptr<ImageLine> images, std::size_t threads, const LapListener& listener)
      : images_(std::move(images)), max_pending_(3 * threads), listener_(listener) {}
  [[nodiscard]] Status forward_first();

  std::unique_ptr<ImageLine> images_;
  std::size_t max_pending_;
  const LapListener& listener_;
  std::deque<Sample> waiting_;
};

bool is_image(const Sample& sample) { return std::holds_alternative<CameraFrame>(sample); }

Result<std::unique_ptr<SampleLine>> SampleLine::make(const SimulatedSetup& setup,
                                                     const LapListener& listener) {
  const auto threads = static_cast<std::size_t>(std::clamp(setup.threads, 1, 64));
  std::unique_ptr<ImageLine> images;
  if (setup.images) {
    const auto world = std::make_shared<const World>(setup.world);
    std::vector<std::unique_ptr<DetectingCamera>> scene_cameras;
    for (std::size_t i = 0; i < threads; ++i) {
      auto scene_camera = scene_cameras.empty() ? DetectingCamera::make(world, setup.cameras(), *setup.images)
                                                : scene_cameras.front()->another();
      if (!scene_camera) return tl::unexpected(scene_camera.error());
      scene_cameras.push_back(std::move(*scene_camera));
    }
    images = std::make_unique<ImageLine>(std::move(scene_cameras));
  }
  return std::unique_ptr<SampleLine>(new SampleLine(std::move(images), threads > 1 ? threads : 0, listener));
}

Status SampleLine::forward_first() {
  Sample sample = std::move(waiting_.front());
  waiting_.pop_front();
  if (!is_image(sample) || !images_) return listener_.on_sample(sample);
  auto seen = images_->pop();
  if (!seen) return tl::unexpected(seen.error());
  if (Status status = listener_.on_image(*seen); !status) return status;
  return listener_.on_sample(seen->found);
}

Status SampleLine::add(Sample sample, const CameraShot& shot) {
  if (images_ && is_image(sample)) images_->push(shot);
  waiting_.push_back(std::move(sample));
  while (!waiting_.empty()) {
    const bool is_pending = images_ && is_image(waiting_.front()) && !images_->ready();
    if (is_pending && images_->pending() <= max_pending_) return {};
    if (Status status = forward_first(); !status) return status;
  }
  return {};
}

Status SampleLine::finish() {
  while (!waiting_.empty()) {
    if (Status status = forward_first(); !status) return status;
  }
  return {};
}

constexpr double kPathStepMetres = 0.02;
/// Makes the noise of the driver independent of that of the sensors.
constexpr std::uint64_t kDriverSeed = 1000;

Result<std::vector<PathPoint>> line_of(const World& world) {
  std::vector<PathPoint> path = sample_path(world.path_m, world.path_closed, kPathStepMetres);
  if (path.size() < 3)
    return fail(ErrorCode::InvalidArgument, "the world has no line to drive", {.source = world.name},
                "Set path_m to at least three distinct points.");
  return path;
}

SimulatedRobot robot_at_start(const SimulatedSetup& setup, const std::vector<PathPoint>& path) {
  return {setup.world,     setup.model,
          setup.cameras(), path.front().map_T_path,
          setup.robot,     setup.images ? CameraOutput::Shots : CameraOutput::Corners};
}

/// The loop for a robot in lockstep, whose time does not advance during a decision.
RobotLoop loop_of(SimulatedSource& source, SimulatedRobot& robot, ImageSearch search, double timeout_s) {
  return {source, robot, lockstep_time([&robot] { return robot.uptime(); }), std::move(search),
          RobotLoopOptions{.timeout_s = timeout_s}};
}

}  // namespace

std::vector<MountedCamera> SimulatedSetup::cameras() const {
  std::vector<MountedCamera> all = {{.name = camera_name, .camera = camera, .base_T_cam = model.base_T_cam}};
  all.insert(all.end(), more_cameras.begin(), more_cameras.end());
  return all;
}

Result<LapEnd> drive_lap(const SimulatedSetup& setup, const DriveFunction& drive, const LapListener& listener,
                         double timeout_s) {
  const Result<std::vector<PathPoint>> path = line_of(setup.world);
  if (!path) return tl::unexpected(path.error());
  const auto line = SampleLine::make(setup, listener);
  if (!line) return tl::unexpected(line.error());
  SimulatedRobot robot = robot_at_start(setup, *path);
  SimulatedSource source(robot);
  RobotListener driver;
  driver.on_sample = [&](const Sample& sample) { return (*line)->add(sample, robot.shot()); };
  driver.decide = [&](Duration uptime, SensorTime now) {
    return drive(robot.true_map_T_base(), uptime, now);
  };
  driver.should_stop = listener.should_stop;
  const auto driven = loop_of(source, robot, {}, timeout_s).drive(driver);
  if (!driven) return tl::unexpected(driven.error());
  if (Status status = (*line)->finish(); !status) return tl::unexpected(status.error());
  return LapEnd{
      .finished = driven->done, .interrupted = driven->interrupted, .lap_s = to_seconds(driven->uptime)};
}

Result<ScriptedDriver> scripted_driver(const SimulatedSetup& setup, const DriverOptions& driver) {
  const Result<std::vector<PathPoint>> path = line_of(setup.world);
  if (!path) return tl::unexpected(path.error());
  return ScriptedDriver(*path, setup.world.path_closed, driver, Random(setup.robot.seed + kDriverSeed));
}

Result<LapEnd> drive_scripted_lap(const SimulatedSetup& setup, const DriverOptions& options,
                                  const LapListener& listener, double timeout_s) {
  Result<ScriptedDriver> driver = scripted_driver(setup, options);
  if (!driver) return tl::unexpected(driver.error());
  return drive_lap(
      setup,
      [&](const SE2& map_T_base, Duration uptime, SensorTime) -> Result<DriverDecision> {
        const VelocityCommand command = driver->drive(map_T_base, SensorTime(uptime));
        return DriverDecision{.command = command, .done = driver->done()};
      },
      listener, timeout_s);
}

Result<ReplayEnd> drive_replay(const SimulatedSetup& setup, Replayer& replayer, const LapListener& listener,
                               const SimulatedReplayOptions& options) {
  const Result<std::vector<PathPoint>> path = line_of(setup.world);
  if (!path) return tl::unexpected(path.error());
  SimulatedRobot robot = robot_at_start(setup, *path);
  std::unique_ptr<DetectingCamera> scene_camera;
  if (setup.images) {
    auto made =
        DetectingCamera::make(std::make_shared<const World>(setup.world), setup.cameras(), *setup.images);
    if (!made) return tl::unexpected(made.error());
    scene_camera = std::move(*made);
  }
  const ImageSearch search{.finder = scene_camera ? &scene_camera->finder() : nullptr,
                           .cameras = setup.cameras()};
  SimulatedSource source(robot, std::move(scene_camera));
  ReplaySession session(replayer, {.on_sample = listener.on_sample, .on_step = listener.on_step},
                        {.give_up_s = options.give_up_s});
  RobotListener driver = session.listener();
  driver.should_stop = listener.should_stop;
  const auto driven = loop_of(source, robot, search, options.timeout_s).drive(driver);
  if (!driven) return tl::unexpected(driven.error());
  // A recording always ends with a zero command.
  if (Status received = driven->done ? listener.on_sample(StampedCommand{robot.now(), {}}) : Status();
      !received)
    return tl::unexpected(received.error());
  ReplayEnd end = session.end(*driven);
  end.lap_s = to_seconds(driven->uptime);
  return end;
}

}  // namespace waymark
