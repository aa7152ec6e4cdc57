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

/// The first drive of a robot (`waymark commission`): what it obeys and what it sends, held against each
/// other, first with lifted wheels, then on the floor.
namespace waymark {

struct CommissionJob {
  bool yes = false;          ///< whoever starts it asks no person
  bool skip_lifted = false;  ///< straight to the floor; the stops are tried there
  double tag_size_m = 0;     ///< of the tags that may be in view; 0: those of the world, else none
  std::string output{};      ///< file of the robot to write; empty: commission_file()

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.output,
          JobField("output FILE",
                   "Robot's file to write the result into. Unless given: that of `robot_file`; of a robot "
                   "that comes with this program, a file of its name in the current folder"));
    visit(self.yes,
          JobField(
              "yes",
              "Do not ask: the robot stands where it may drive, and checks that need a person are left out"));
    visit(self.skip_lifted, JobField("skip_lifted", "Leave out the drive with lifted wheels"));
    visit(self.tag_size_m,
          JobField("tag_size_m FLOAT",
                   "Side of the black squares of the tags that are in view, which measure the drive as well",
                   0.001, 10.0));
  }
};

/// Whoever stands beside the robot.
struct CommissionPerson {
  bool there = false;  ///< can press keys and pull cables
  /// Returns once the robot is as the words ask for. Fails where it will not be.
  std::function<Status(const std::string& words)> ready = [](const std::string&) { return Status(); };
  /// Yes, no, or nothing where nobody looked.
  std::function<Seen(const std::string& question)> saw = [](const std::string&) { return Seen(); };
};

/// Who sits at the terminal: asked by notes, answers are lines of standard input.
[[nodiscard]] CommissionPerson person_at_terminal(const JobControl& control);

/// A verdict and when it was found: lifted, stops, floor.
struct CommissionFinding {
  std::string step{};
  CommissionLine line{};
};

struct CommissionReport {
  std::vector<CommissionFinding> findings{};
  CommissionFigures figures{};
  bool real = true;          ///< not simulated
  bool passed = false;       ///< nothing failed, and it was on the floor
  bool interrupted = false;  ///< nothing was written
  std::string file{};        ///< that holds the result now; empty: none
  std::string kept{};        ///< what was there before, under this name; empty: nothing was
};

/// Drives the robot of the setup, which is a process, at 0.1 m/s and 0.4 rad/s, and writes the result into
/// its file (a simulated robot's only where `output` names one). Lifted wheels that fail are not put on the
/// floor. Fails where the robot cannot be started or the file not written. However it ends, the robot stands.
[[nodiscard]] Result<CommissionReport> commission(const RobotSetup& setup, const CommissionJob& job,
                                                  const CommissionPerson& person, const JobControl& control);

/// Where the result goes unless told: the robot's file; of one that comes with this program a file of its
/// name in the current folder.
[[nodiscard]] std::string commission_file(const RobotSetup& setup);

[[nodiscard]] std::string to_text(const CommissionReport& report);
[[nodiscard]] ReportFields fields(const CommissionFinding& finding);
[[nodiscard]] ReportFields fields(const CommissionReport& report);

}  // namespace waymark
