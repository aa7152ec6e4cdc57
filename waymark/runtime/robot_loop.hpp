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

/// The time a drive goes by.
struct Pacing {
  /// Never goes back.
  std::function<Duration()> clock;
  /// The robot's time stands still until each of its requests is answered: commands are decided when it asks,
  /// every picture is searched for tags, and the clock counts from when the robot was switched on. Otherwise
  /// commands are decided as time passes, and only the newest picture counts.
  bool lockstep = false;
};

/// By the steady clock of this computer.
[[nodiscard]] Pacing real_time();
/// By the clock of a robot that waits for its commands.
[[nodiscard]] Pacing lockstep_time(std::function<Duration()> robots_clock);

/// Holds back what a camera saw before what it has shown already: out of order, it would be recorded as a
/// trajectory that goes back in time. A stamp that goes back by more than a second is a clock that jumped, of
/// which others speak: it passes.
class FrameOrder {
 public:
  /// False where the sample is to be left out. Samples that are of no camera pass.
  bool pass(const Sample& sample);
  /// How many were left out, in words; each time that their number has doubled, since the last call.
  [[nodiscard]] std::optional<std::string> take_report() { return std::exchange(words_, std::nullopt); }
  [[nodiscard]] int left_out() const { return left_out_; }

 private:
  std::map<std::pair<std::size_t, std::string>, SensorTime> newest_{};  ///< by type and camera
  int left_out_ = 0;
  std::optional<std::string> words_{};
};

/// Pictures that wait for the detector: of each camera the newest alone, so that a slow detector never works
/// on what is long past.
class PictureQueue {
 public:
  /// Takes the place of a picture of the same camera that still waits, and counts that one as dropped.
  void push(CameraFrame picture);
  /// The one that waits longest; nothing when none waits.
  [[nodiscard]] std::optional<CameraFrame> pop();
  [[nodiscard]] bool empty() const { return waiting_.empty(); }
  [[nodiscard]] int dropped() const { return dropped_; }

 private:
  std::deque<CameraFrame> waiting_{};
  int dropped_ = 0;
};

/// What whoever drives decides.
struct DriverDecision {
  VelocityCommand command{};
  bool done = false;                  ///< the drive is over; the command is then the last one
  std::optional<GamepadState> pad{};  ///< what the driver held in hand; a sample like any other
  std::vector<std::string> words{};   ///< for the driver: that the gamepad was unplugged
};

/// What becomes of a robot that is driven.
struct RobotListener {
  /// Every sample in the order in which they came, tags right after the picture they were found in, and the
  /// commands that were sent; of a robot that says itself by which commands it is driven, those instead. An
  /// error ends the drive.
  std::function<Status(const Sample&)> on_sample = [](const Sample&) { return Status(); };
  /// Asked for a command twenty times a second and right after each picture; in lockstep when the robot asks.
  /// An error ends the drive.
  std::function<Result<DriverDecision>(Duration uptime, SensorTime now)> decide;
  /// Where tags should be in a picture, from a pose and a map; there they are read with more wrong bits, and
  /// it is said why one is not found.
  std::function<std::vector<ExpectedTag>(const MountedCamera& camera, SensorTime stamp)> expected =
      [](const MountedCamera&, SensorTime) { return std::vector<ExpectedTag>(); };
  /// After each picture in which a tag was expected: those that were not found.
  std::function<void(std::vector<MissedTag> missed)> on_missed = [](const std::vector<MissedTag>&) {};
  /// Whether to stop the robot and end the drive now.
  std::function<bool()> should_stop = [] { return false; };
  /// What the robot says to people.
  std::function<void(const std::string&)> on_text = [](const std::string&) {};
};

/// How tags are found in a robot's pictures. Without a finder pictures are samples like any other, and none
/// is held back.
struct PictureSearch {
  const TagFinder* finder = nullptr;     ///< outlives the loop
  std::vector<MountedCamera> cameras{};  ///< whose lenses bend the edges of tags; a picture of none: straight
};

struct RobotLoopOptions {
  Duration period = std::chrono::milliseconds(50);   ///< between decisions, in real time
  Duration resend = std::chrono::milliseconds(100);  ///< after which an answer in lockstep counts as lost
  double timeout_s = std::numeric_limits<double>::infinity();
  /// In real time: a robot that has sent no sensor sample for so long fails the drive.
  double first_sample_s = 15;
  /// Somebody else drives: nothing is sent to the robot, neither zero, and what is decided is not a sample.
  bool listen_only = false;
};

struct RobotLoopEnd {
  bool done = false;         ///< the driver said so
  bool interrupted = false;  ///< should_stop() said so
  bool timed_out = false;
  Duration uptime{};   ///< since the drive began; in lockstep since the robot was switched on
  double seconds = 0;  ///< by the robot's clock, from its first sample on
};

/// The loop between samples and commands of any robot. However it ends, the last command is zero, where it
/// commands at all.
class RobotLoop {
 public:
  /// Source and robot outlive the loop.
  RobotLoop(Source& source, Robot& robot, Pacing pacing, PictureSearch search = {},
            const RobotLoopOptions& options = {});

  /// Drives until the driver is done, the time is over, somebody wants it to stop, or something fails.
  Result<RobotLoopEnd> drive(const RobotListener& listener);
  /// Pictures that came faster than tags could be looked for in them, and were not searched.
  [[nodiscard]] int dropped_pictures() const { return pictures_.dropped(); }
  /// Whether tags were looked for in a picture.
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
  std::map<std::string, TagSequence> sequences_{};  ///< of each camera, by its name
  bool due_ = false;
  Duration began_{};
  Duration next_decision_{};
  std::optional<SensorTime> first_{};
  VelocityCommand last_{};
  bool robot_reports_commands_ = false;  ///< its samples hold the commands that drive it
};

}  // namespace waymark
