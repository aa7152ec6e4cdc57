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

/// The clock of a drive.
struct Pacing {
  /// Monotonic clock.
  std::function<Duration()> clock;
  /// Lockstep: the robot's time does not advance until each of its requests is answered. Commands are then
  /// decided on its requests, every image is searched for tags, and the clock counts from the start of the
  /// robot. Otherwise commands are decided periodically, and only the newest image is searched.
  bool lockstep = false;
};

/// The steady clock of this computer.
[[nodiscard]] Pacing real_time();
/// The clock of a robot that waits for its commands.
[[nodiscard]] Pacing lockstep_time(std::function<Duration()> robots_clock);

/// Skips frames of a camera that are older than its newest one, because out of order they would be recorded
/// as a trajectory that goes back in time. A stamp that goes back by more than one second is a clock jump; it
/// is passed on and reported elsewhere.
class FrameOrder {
 public:
  /// False if the sample is to be skipped. Samples that are not from a camera pass.
  bool pass(const Sample& sample);
  /// Reports the number of skipped frames each time it has doubled since the last report.
  [[nodiscard]] std::optional<std::string> take_report() { return std::exchange(words_, std::nullopt); }
  [[nodiscard]] int left_out() const { return left_out_; }

 private:
  std::map<std::pair<std::size_t, std::string>, SensorTime> newest_{};  ///< by sample type and camera
  int left_out_ = 0;
  std::optional<std::string> words_{};
};

/// Images waiting for the detector. Only the newest of each camera is kept, so that a slow detector does not
/// process outdated images.
class PictureQueue {
 public:
  /// Replaces a waiting image of the same camera, which is counted as dropped.
  void push(CameraFrame picture);
  /// The image that has waited longest; none if the queue is empty.
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
  bool done = false;                    ///< the drive is over; the command is the last one
  std::optional<GamepadState> pad{};    ///< gamepad state of the driver, recorded like any other sample
  std::vector<std::string> messages{};  ///< messages for the driver, e.g. that the gamepad was unplugged
};

/// Callbacks of RobotLoop.
struct RobotListener {
  /// Called with every sample in order of arrival, tags directly after the image in which they were found,
  /// and the commands sent. If the robot reports the commands that drive it, those are passed instead. An
  /// error ends the drive.
  std::function<Status(const Sample&)> on_sample = [](const Sample&) { return Status(); };
  /// Called for a command 20 times per second and directly after each image; in lockstep, on each request of
  /// the robot. An error ends the drive.
  std::function<Result<DriverDecision>(Duration uptime, SensorTime now)> decide;
  /// Tags expected in an image, from pose and map. They are decoded there with more bit errors, and a reason
  /// is reported if one is not found.
  std::function<std::vector<ExpectedTag>(const MountedCamera& camera, SensorTime stamp)> expected =
      [](const MountedCamera&, SensorTime) { return std::vector<ExpectedTag>(); };
  /// Called after each image with expected tags, with those that were not found.
  std::function<void(std::vector<MissedTag> missed)> on_missed = [](const std::vector<MissedTag>&) {};
  /// Whether to stop the robot and end the drive now.
  std::function<bool()> should_stop = [] { return false; };
  /// Messages from the robot for the user.
  std::function<void(const std::string&)> on_text = [](const std::string&) {};
};

/// Detection of tags in the images of a robot. Without a finder images are passed on like any other sample.
struct PictureSearch {
  const TagFinder* finder = nullptr;     ///< must outlive the loop
  std::vector<MountedCamera> cameras{};  ///< with lens models, for curved tag edges; images of other cameras
                                         ///< are assumed free of distortion
};

struct RobotLoopOptions {
  Duration period = std::chrono::milliseconds(50);   ///< between decisions, in real time
  Duration resend = std::chrono::milliseconds(100);  ///< time after which an answer in lockstep is sent again
  double timeout_s = std::numeric_limits<double>::infinity();
  /// In real time: the drive fails if the robot has sent no sensor sample for this time.
  double first_sample_s = 15;
  /// Listen only: no command is sent, not even zero, and decisions are not recorded.
  bool listen_only = false;
};

struct RobotLoopEnd {
  bool done = false;         ///< by the driver
  bool interrupted = false;  ///< by should_stop()
  bool timed_out = false;
  Duration uptime{};   ///< since the drive began; in lockstep since the start of the robot
  double seconds = 0;  ///< by the clock of the robot, from its first sample
};

/// The loop between samples and commands of any robot. The last command is always zero, unless the loop only
/// listens.
class RobotLoop {
 public:
  /// Source and robot must outlive the loop.
  RobotLoop(Source& source, Robot& robot, Pacing pacing, PictureSearch search = {},
            const RobotLoopOptions& options = {});

  /// Drives until the driver is done, the time is over, should_stop() returns true, or an error occurs.
  Result<RobotLoopEnd> drive(const RobotListener& listener);
  /// Number of images that were not searched because the detector was too slow.
  [[nodiscard]] int dropped_pictures() const { return pictures_.dropped(); }
  /// Whether any image was searched for tags.
  [[nodiscard]] bool searched() const { return !sequences_.empty(); }

 private:
  Status take_event(const RobotListener& listener);
  Status receive(Sample sample, const RobotListener& listener);
  Status search_picture(const RobotListener& listener);
  Status decide(const RobotListener& listener, RobotLoopEnd& end);
  Status send(const VelocityCommand& command, SensorTime now, const RobotListener& listener);
  Status run(const RobotListener& listener, RobotLoopEnd& end);
  Status command_zero();
  [[nodiscard]] Duration uptime() const { return pacing_.clock() - began_; }
  [[nodiscard]] Duration patience() const;

  Source& source_;
  Robot& robot_;
  Pacing pacing_;
  PictureSearch search_;
  RobotLoopOptions options_;
  FrameOrder order_{};
  PictureQueue pictures_{};
  std::map<std::string, TagSequence> sequences_{};  ///< by camera name
  bool due_ = false;
  Duration began_{};
  Duration next_decision_{};
  std::optional<SensorTime> first_{};
  VelocityCommand last_{};
  bool robot_reports_commands_ = false;  ///< its samples contain the commands that drive it
};

}  // namespace waymark
