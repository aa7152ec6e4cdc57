#pragma once

#include <functional>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/config/yaml/commission_record.hpp"
#include "waymark/runtime/commission_lines.hpp"

/// The first drive of a robot (`waymark commission`): compares commands with sensor data, first with lifted
/// wheels, then on the floor.
namespace waymark {

struct CommissionJob {
  bool yes = false;          ///< no questions
  bool skip_lifted = false;  ///< begin on the floor; the stops are tested there
  double tag_size_m = 0;     ///< size of the tags in view; 0: the tags of the world, if it is known
  std::string output{};      ///< robot file to write; empty: commission_file()

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.output,
          JobField("output FILE",
                   "Robot file for the result. Default: `robot_file`; for a robot that comes with this "
                   "program, a file with its name in the current folder"));
    visit(self.yes,
          JobField("yes",
                   "Do not ask, and skip checks that need a person; the robot must be where it may drive"));
    visit(self.skip_lifted, JobField("skip_lifted", "Skip the drive with lifted wheels"));
    visit(
        self.tag_size_m,
        JobField("tag_size_m FLOAT",
                 "Side of the black squares of the tags in view, which also measure the drive", 0.001, 10.0));
  }
};

/// The person at the robot.
struct CommissionPerson {
  bool present = false;  ///< can press keys and pull cables
  /// Returns when the person has done the requested action. Fails if no person answers.
  std::function<Status(const std::string& words)> ready = [](const std::string&) { return Status(); };
  /// The answer to a question about the last motion: yes, no, or nothing.
  std::function<Seen(const std::string& question)> confirm = [](const std::string&) { return Seen(); };
};

/// A person at the terminal: questions are notes, answers are lines of standard input.
[[nodiscard]] CommissionPerson person_at_terminal(const JobControl& control);

/// A verdict and its step: lifted, stops, floor or end.
struct CommissionFinding {
  std::string step{};
  CommissionLine line{};
};

struct CommissionReport {
  std::vector<CommissionFinding> findings{};
  CommissionFigures figures{};
  bool real = true;          ///< not simulated
  bool passed = false;       ///< no check failed, and the robot was driven on the floor
  bool interrupted = false;  ///< nothing was written
  std::string file{};        ///< file with the result; empty: none
  std::string kept{};        ///< backup of the previous file; empty: there was none
};

/// Drives the robot of the setup, a process, at 0.1 m/s and 0.4 rad/s, and writes the result into its file
/// (for a simulated robot only if `output` is given). If a check with lifted wheels fails, the robot is not
/// driven on the floor. Fails if the robot cannot be started or the file cannot be written. The robot is
/// always stopped at the end.
[[nodiscard]] Result<CommissionReport> commission(const RobotSetup& setup, const CommissionJob& job,
                                                  const CommissionPerson& person, const JobControl& control);

/// The default output: the robot's file; for a robot that comes with this program, a file with its name in
/// the current folder.
[[nodiscard]] std::string commission_file(const RobotSetup& setup);

[[nodiscard]] std::string to_text(const CommissionReport& report);
[[nodiscard]] ReportFields fields(const CommissionFinding& finding);
[[nodiscard]] ReportFields fields(const CommissionReport& report);

}  // namespace waymark
