#pragma once

#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "waymark/base/time.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/robot.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {

/// Determines the clock of a drive.
struct Pacing {
  /// Monotonic clock.
  std::function<Duration()> clock;
  /// In lockstep, the robot's time does not advance until each of its requests has been answered. Commands
  /// are then decided on request, every image is searched for tags, and the clock starts when the robot
  /// starts. Otherwise commands are decided periodically, and only the newest image is searched.
  bool lockstep = false;
};

/// Uses the steady clock of this computer.
[[nodiscard]] Pacing real_time();
/// Uses the clock of a robot that waits for its commands.
[[nodiscard]] Pacing lockstep_time(std::function<Duration()> robots_clock);

/// Skips camera frames that are older than the newest one from the same camera; recording them would produce
/// a trajectory that goes back in time. If a timestamp goes back by more than one second, the clock has
/// jumped; such a frame is passed on, and the jump is reported elsewhere.
class FrameOrder {
 public:
  /// Returns false if the sample should be skipped. Samples that are not from a camera always pass.
  bool pass(const Sample& sample);
  /// Returns a message with the number of skipped frames each time this number has doubled since the last
  /// report.
  [[nodiscard]] std::optional<std::string> take_report() { return std::exchange(words_, std::nullopt); }
  [[nodiscard]] int left_out() const { return left_out_; }

 private:
  std::map<std::pair<std::size_t, std::string>, SensorTime> newest_{};  ///< newest timestamp by sample type
                                                                        ///< and camera
  int left_out_ = 0;
  std::optional<std::string> words_{};
};

/// Images waiting to be searched. Only the newest image from each camera is kept, so that a slow detector
/// does not search outdated ones.
class ImageQueue {
 public:
  /// Replaces a waiting image from the same camera, which then counts as dropped.
  void push(CameraFrame image);
  /// Returns the image that has waited longest; `nullopt` if the queue is empty.
  [[nodiscard]] std::optional<CameraFrame> pop();
  [[nodiscard]] bool empty() const { return waiting_.empty(); }
  [[nodiscard]] int dropped() const { return dropped_; }

 private:
  std::deque<CameraFrame> waiting_{};
  int dropped_ = 0;
};

/// A driver's decision.
struct DriverDecision {
  VelocityCommand command{};
  bool done = false;                    ///< whether the drive is over; the command is then the last one
  std::optional<GamepadState> pad{};    ///< gamepad state of the driver, recorded like any other sample
  std::vector<std::string> messages{};  ///< messages for the driver, such as that the gamepad was unplugged
};

/// Callbacks for RobotLoop.
struct RobotListener {
  /// Called with every sample in the order of arrival. Tags directly follow the image in which they were
  /// found. Commands that are sent are passed as well; if the robot reports the commands that drive it, those
  /// are passed instead. An error ends the drive.
  std::function<Status(const Sample&)> on_sample = [](const Sample&) { return Status(); };
  /// Asked for a command 20 times per second and directly after each image; in lockstep, on each request from
  /// the robot. An error ends the drive.
  std::function<Result<DriverDecision>(Duration uptime, SensorTime now)> decide;
  /// The tags expected in an image, based on the pose and the map. More bit errors are tolerated when these
  /// are decoded, and a reason is reported for each one that is not found.
  std::function<std::vector<ExpectedTag>(const MountedCamera& camera, SensorTime stamp)> expected =
      [](const MountedCamera&, SensorTime) { return std::vector<ExpectedTag>(); };
  /// Called after each image in which tags were expected, with those that were not found.
  std::function<void(std::vector<MissedTag> missed)> on_missed = [](const std::vector<MissedTag>&) {};
  /// Whether to stop the robot and end the drive now.
  std::function<bool()> should_stop = [] { return false; };
  /// Called with messages from the robot to the user.
  std::function<void(const std::string&)> on_text = [](const std::string&) {};
};

/// How tags are detected in images from a robot. If there is no finder, images are passed on like any other
/// sample.
struct ImageSearch {
  const TagFinder* finder = nullptr;     ///< finder, which must outlive the loop
  std::vector<MountedCamera> cameras{};  ///< cameras with lens models, for tag edges that are curved; other
                                         ///< cameras are assumed to be free of distortion
};

struct RobotLoopOptions {
  Duration period = std::chrono::milliseconds(50);   ///< time between decisions in real time
  Duration resend = std::chrono::milliseconds(100);  ///< time after which a response in lockstep is sent
                                                     ///< again
  double timeout_s = std::numeric_limits<double>::infinity();
  /// In real time, the drive fails if the robot has not sent any sensor sample within this time.
  double first_sample_s = 15;
  /// If true, the loop only listens. No command is sent, not even zero, and decisions are not recorded.
  bool listen_only = false;
};

struct RobotLoopEnd {
  bool done = false;         ///< whether the driver ended the drive
  bool interrupted = false;  ///< whether should_stop() ended the drive
  bool timed_out = false;
  Duration uptime{};   ///< time since the drive started or, in lockstep, since the robot started
  double seconds = 0;  ///< duration on the robot's clock, from its first sample
};

/// The loop from samples to commands for any robot. The last command is always zero, unless the loop only
/// listens.
class RobotLoop {
 public:
  /// The source and the robot must outlive the loop.
  RobotLoop(Source& source, Robot& robot, Pacing pacing, ImageSearch search = {},
            const RobotLoopOptions& options = {});

  /// Drives until the driver is done, the time is up, should_stop() returns true, or an error occurs.
  Result<RobotLoopEnd> drive(const RobotListener& listener);
  /// Number of images that were not searched because the detector was too slow.
  [[nodiscard]] int dropped_images() const { return images_.dropped(); }
  /// Whether any image was searched for tags.
  [[nodiscard]] bool searched() const { return !sequences_.empty(); }

 private:
  Status take_event(const RobotListener& listener);
  Status receive(Sample sample, const RobotListener& listener);
  Status search_image(const RobotListener& listener);
  Status decide(const RobotListener& listener, RobotLoopEnd& end);
  Status send(const VelocityCommand& command, SensorTime now, const RobotListener& listener);
  Status run(const RobotListener& listener, RobotLoopEnd& end);
  Status command_zero();
  [[nodiscard]] Duration uptime() const { return pacing_.clock() - began_; }
  [[nodiscard]] Duration patience() const;

  Source& source_;
  Robot& robot_;
  Pacing pacing_;
  ImageSearch search_;
  RobotLoopOptions options_;
  FrameOrder order_{};
  ImageQueue images_{};
  std::map<std::string, TagSequence> sequences_{};  ///< tag sequences by camera name
  bool due_ = false;
  Duration began_{};
  Duration next_decision_{};
  std::optional<SensorTime> first_{};
  VelocityCommand last_{};
  bool robot_reports_commands_ = false;  ///< whether its samples contain the commands that drive it
};

}  // namespace waymark
