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
#include "waymark/robots/wire/robot_output.hpp"

namespace waymark {

/// Reports that a robot is silent, each report once until the robot sends again. Pure.
class SilenceReports {
 public:
  struct Report {
    Duration after{};  ///< the silence is longer than this
    std::string text{};
    std::string text_listening{};  ///< if another program drives; empty: `text`
  };
  /// Silence up to `pause` is ignored and makes all reports due again.
  SilenceReports(Duration pause, std::vector<Report> reports)
      : pause_(pause), reports_(std::move(reports)), reported_(reports_.size(), false) {}

  /// The reports that are due and were not returned yet.
  [[nodiscard]] std::vector<std::string> take_reports(Duration silent, bool listens = false);

 private:
  Duration pause_;
  std::vector<Report> reports_;
  std::vector<bool> reported_;
};

/// The output of a robot process if the robot does not send anything.
struct NoContact {
  std::string report{};  ///< after report_after
  Status gave_up{};      ///< after give_up_after: the error that ends the process
};

struct WireLoopOptions {
  Duration report_after = std::chrono::seconds(3);
  Duration give_up_after = std::chrono::seconds(12);
  Duration check_period{};             ///< between calls of check(); zero: every turn
  bool report_again = false;           ///< print the report again whenever its text has changed
  bool commands_before_hello = false;  ///< the robot sends only after it received commands
};

/// The loop of a robot process (docs/formats/robot-process.md), which is the same for every network. Receives
/// from the robot, writes the hello once the robot may be commanded, and sends the input's commands until the
/// input ends. If the robot sends nothing, it reports what was found and finally gives up. Each robot derives
/// from this class and implements its network. Each turn calls the functions below in their order.
class WireLoop {
 public:
  /// `wire` outlives this; `now` is a steady clock.
  explicit WireLoop(const RobotWire& wire, const WireLoopOptions& options = {},
                    std::function<Duration()> now = steady_now)
      : wire_(wire), options_(options), now_(std::move(now)), output_(wire) {}
  virtual ~WireLoop() = default;
  WireLoop(const WireLoop&) = delete;
  WireLoop& operator=(const WireLoop&) = delete;

  /// Runs until the input ends, the reader of the output has gone, or `wire.should_stop` returns true.
  /// Nothing is sent to the robot after it returns.
  [[nodiscard]] Status run();

 protected:
  [[nodiscard]] RobotOutput& output() { return output_; }
  [[nodiscard]] bool greeted() const { return output_.greeted(); }
  [[nodiscard]] InputRole role() const { return role_; }
  /// Whether another program drives the robot.
  [[nodiscard]] bool listens() const { return role_ == InputRole::Listens; }
  /// Whether the command input has ended.
  [[nodiscard]] bool input_ended() const { return input_ended_; }
  /// Time since the loop began.
  [[nodiscard]] Duration waited() const { return now_() - began_; }

 private:
  /// Waits briefly for messages of the robot and forwards them.
  virtual Status poll_robot() = 0;
  /// Before the hello: returns whether it may be written. Fails if it can never be written.
  virtual Result<bool> ready() = 0;
  /// Before the hello: ensures that the robot may be commanded.
  virtual Status prepare() { return {}; }
  virtual RobotHello hello() const = 0;
  virtual void after_hello() {}
  /// Sends a command to the robot. Called on the sender's thread.
  virtual void send(const VelocityCommand& command) = 0;
  /// Whether zero is sent instead of commands because the robot is silent.
  virtual bool must_hold(Duration /*now*/) const { return false; }
  /// Messages about a silent robot; empty ones are skipped.
  virtual std::vector<std::string> silence_reports(Duration /*now*/) { return {}; }
  /// Further checks, before and after the hello.
  virtual Status check() { return {}; }
  /// Whether the robot has not sent anything yet, so that the process reports it and finally gives up.
  virtual bool waits() const { return !greeted(); }
  virtual NoContact no_contact() = 0;

  class Orders;
  Status greet(Orders& orders);
  Status run_checks();
  Status wait_for_robot(Duration waited);

  const RobotWire& wire_;
  WireLoopOptions options_;
  std::function<Duration()> now_;
  RobotOutput output_;
  InputRole role_ = InputRole::Unknown;
  bool input_ended_ = false;
  bool reported_ = false;
  Duration began_{};
  Duration next_check_{};
};

}  // namespace waymark
