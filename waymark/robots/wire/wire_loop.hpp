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

/// Reports that a robot is silent, making each report once until the robot sends data again. Pure.
class SilenceReports {
 public:
  struct Report {
    Duration after{};  ///< reported when the silence is longer than this
    std::string text{};
    std::string text_listening{};  ///< used if another program drives; `text` if empty
  };
  /// Silence of up to `pause` is ignored and makes all reports due again.
  SilenceReports(Duration pause, std::vector<Report> reports)
      : pause_(pause), reports_(std::move(reports)), reported_(reports_.size(), false) {}

  /// The reports that are due and have not been returned yet.
  [[nodiscard]] std::vector<std::string> take_reports(Duration silent, bool listens = false);

 private:
  Duration pause_;
  std::vector<Report> reports_;
  std::vector<bool> reported_;
};

/// What a robot process reports if the robot does not send anything.
struct NoContact {
  std::string report{};  ///< reported after report_after
  Status gave_up{};      ///< the error that ends the process after give_up_after
};

struct WireLoopOptions {
  Duration report_after = std::chrono::seconds(3);
  Duration give_up_after = std::chrono::seconds(12);
  Duration check_period{};             ///< time between calls of check(); every turn if zero
  bool report_again = false;           ///< whether to print the report again whenever its text has changed
  bool commands_before_hello = false;  ///< whether the robot only sends data once it has received commands
};

/// The loop of a robot process (docs/formats/robot-process.md), which is the same for every network. It
/// receives data from the robot, writes the hello once the robot may be commanded, and sends the commands
/// from the input until the input ends. If the robot sends nothing, it reports what was found and finally
/// gives up. Each kind of robot derives from this class and implements its network. In each turn, the
/// functions below are called in order.
class WireLoop {
 public:
  /// `wire` must outlive this object; `now` is a steady clock.
  explicit WireLoop(const RobotWire& wire, const WireLoopOptions& options = {},
                    std::function<Duration()> now = steady_now)
      : wire_(wire), options_(options), now_(std::move(now)), output_(wire) {}
  virtual ~WireLoop() = default;
  WireLoop(const WireLoop&) = delete;
  WireLoop& operator=(const WireLoop&) = delete;

  /// Runs until the input ends, the reader of the output has disconnected, or `wire.should_stop` returns
  /// true. Nothing is sent to the robot after it returns.
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
  /// Waits briefly for messages from the robot and forwards them.
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
  /// Whether the robot has not sent anything yet, so that the process reports this and finally gives up.
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
