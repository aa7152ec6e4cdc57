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

/// Performs the first drive of a robot (`waymark commission`): compares commands with sensor data, first with
/// the wheels lifted, then on the floor.
namespace waymark {

struct CommissionJob {
  bool yes = false;          ///< whether to ask no questions
  bool skip_lifted = false;  ///< whether to start on the floor, where the stops are then tested as well
  double tag_size_m = 0;     ///< size of the visible tags; if 0, that of the tags in the world, if it is
                             ///< known
  std::string output{};      ///< robot file to write; commission_file() if empty

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

/// The person who is with the robot.
struct CommissionPerson {
  bool present = false;  ///< whether the person can press keys and pull cables
  /// Returns once the person has done what was asked. Fails if there is no response.
  std::function<Status(const std::string& words)> ready = [](const std::string&) { return Status(); };
  /// The response to a question about the last motion: yes, no, or `nullopt`.
  std::function<Seen(const std::string& question)> confirm = [](const std::string&) { return Seen(); };
};

/// A person at the terminal. Questions are printed as notes, and responses are read as lines from standard
/// input.
[[nodiscard]] CommissionPerson person_at_terminal(const JobControl& control);

/// A verdict and the step that it belongs to: lifted, stops, floor or end.
struct CommissionFinding {
  std::string step{};
  CommissionLine line{};
};

struct CommissionReport {
  std::vector<CommissionFinding> findings{};
  CommissionFigures figures{};
  bool real = true;          ///< whether the robot is real rather than simulated
  bool passed = false;       ///< whether no check failed and the robot was driven on the floor
  bool interrupted = false;  ///< if true, nothing was written
  std::string file{};        ///< file with the result; empty if none was written
  std::string kept{};        ///< backup of the previous file; empty if there was none
};

/// Drives the robot of the setup, which must be a process, at 0.1 m/s and 0.4 rad/s. Writes the result to the
/// robot's file (for a simulated robot only if `output` is set). If a check with lifted wheels fails, the
/// robot is not driven on the floor. Fails if the robot cannot be started or the file cannot be written. The
/// robot is always stopped at the end.
[[nodiscard]] Result<CommissionReport> commission(const RobotSetup& setup, const CommissionJob& job,
                                                  const CommissionPerson& person, const JobControl& control);

/// The default output file: the robot's file or, for a robot included with this program, a file with the same
/// name in the current folder.
[[nodiscard]] std::string commission_file(const RobotSetup& setup);

[[nodiscard]] std::string to_text(const CommissionReport& report);
[[nodiscard]] ReportFields fields(const CommissionFinding& finding);
[[nodiscard]] ReportFields fields(const CommissionReport& report);

}  // namespace waymark
