#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/robots/process/robot_messages.hpp"
#include "waymark/robots/process/robot_wire.hpp"
#include "waymark/robots/watchdog/pipes.hpp"
#include "waymark/robots/wire/robot_talk.hpp"

namespace waymark {

/// Reports that a robot is silent, each report once until the robot is heard again. Pure.
class SilenceReports {
 public:
  struct Report {
    Duration after{};  ///< the silence is longer than this
    std::string words{};
    std::string words_listening{};  ///< if another program drives; empty: the same
  };
  /// A silence of `pause` or less is none: all reports are due again.
  SilenceReports(Duration pause, std::vector<Report> reports)
      : pause_(pause), reports_(std::move(reports)), said_(reports_.size(), false) {}

  /// The reports that are due and were not printed yet.
  [[nodiscard]] std::vector<std::string> take_words(Duration silent, bool listens = false);

 private:
  Duration pause_;
  std::vector<Report> reports_;
  std::vector<bool> said_;
};

/// What the process of a robot prints if the robot is not heard.
struct Unheard {
  std::string report{};  ///< after report_after
  Status gave_up{};      ///< after give_up_after: the error that ends the process
};

struct WireLoopOptions {
  Duration report_after = std::chrono::seconds(3);
  Duration give_up_after = std::chrono::seconds(12);
  Duration look_every{};               ///< between calls of look(); zero: every turn
  bool report_again = false;           ///< print the report again whenever its text has changed
  bool commands_before_hello = false;  ///< the robot must be commanded before it can be heard
};

/// The loop of a robot's process (docs/formats/robot-process.md), the same on every wire: hears the robot,
/// writes the hello once the robot may be commanded, sends the commands of the input until the input ends,
/// prints what was found if the robot is not heard, and gives up. A robot derives from it and implements what
/// its wire is. A turn calls the functions below in their order.
class WireLoop {
 public:
  /// `wire` outlives this; `now` is a steady clock.
  explicit WireLoop(const RobotWire& wire, const WireLoopOptions& options = {},
                    std::function<Duration()> now = steady_now)
      : wire_(wire), options_(options), now_(std::move(now)), talk_(wire) {}
  virtual ~WireLoop() = default;
  WireLoop(const WireLoop&) = delete;
  WireLoop& operator=(const WireLoop&) = delete;

  /// Until the input ends, its reader is gone, or the wire says that it should stop. Nothing is sent to the
  /// robot once it returns.
  [[nodiscard]] Status run();

 protected:
  [[nodiscard]] RobotTalk& talk() { return talk_; }
  [[nodiscard]] bool greeted() const { return talk_.greeted(); }
  [[nodiscard]] InputRole role() const { return role_; }
  /// Another program drives the robot.
  [[nodiscard]] bool listens() const { return role_ == InputRole::Listens; }
  /// The input of the commands has ended.
  [[nodiscard]] bool input_ended() const { return input_ended_; }
  /// Since the loop began.
  [[nodiscard]] Duration waited() const { return now_() - began_; }

 private:
  /// Waits a moment for what the robot sends, and passes it on.
  virtual Status hear() = 0;
  /// Before the hello: whether it may be written. Fails if it never may be.
  virtual Result<bool> ready() = 0;
  /// Before the hello: makes sure that the robot may be commanded.
  virtual Status prepare() { return {}; }
  virtual RobotHello hello() const = 0;
  virtual void after_hello() {}
  /// Puts a command on the wire. On the thread of the sender.
  virtual void send(const VelocityCommand& command) = 0;
  /// Whether zero is sent in place of commands, because the robot is not heard any more.
  virtual bool must_hold(Duration /*now*/) const { return false; }
  /// What is to be printed of a robot that is not heard any more; empty words are skipped.
  virtual std::vector<std::string> silence_words(Duration /*now*/) { return {}; }
  /// Looks around: what else there is to check, before and after the hello.
  virtual Status look() { return {}; }
  /// Whether the robot is not heard yet, so that the process reports and gives up.
  virtual bool waits() const { return !greeted(); }
  virtual Unheard unheard() = 0;

  class Orders;
  Status greet(Orders& orders);
  Status look_around();
  Status wait_for_robot(Duration waited);

  const RobotWire& wire_;
  WireLoopOptions options_;
  std::function<Duration()> now_;
  RobotTalk talk_;
  InputRole role_ = InputRole::Unknown;
  bool input_ended_ = false;
  bool reported_ = false;
  Duration began_{};
  Duration next_look_{};
};

}  // namespace waymark
