#pragma once

#include <string>
#include <vector>

#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/replay/route_optimizer.hpp"

/// `waymark optimize`: a faster or smoother route beside a taught one.
namespace waymark {

struct OptimizeJob {
  std::string folder{};       ///< that `waymark map` wrote
  std::string name = "best";  ///< of the new route
  OptimizerOptions options{};
  ProfileOptions profile{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.folder, JobField("folder MAP", "Folder that `waymark map` wrote").input().required());
    visit(self.name, JobField("name NAME", "Name of the new route; the taught one stays as it is"));
  }
};

/// The options of the optimisation in a .yaml file.
[[nodiscard]] Result<OptimizerOptions> read_weights(const std::string& path);

struct OptimizeReport {
  std::string name{};  ///< of the new route
  OptimizedRoute found{};
  std::vector<std::string> files{};      ///< that were written
  std::vector<std::string> set_aside{};  ///< what stood there before, and has a number in its name now
};

/// Writes the route with its picture in the place of what the folder holds of a route of this name: both, or
/// nothing.
[[nodiscard]] Result<OptimizeReport> optimize_route_of(const OptimizeJob& job);
/// The command that drives the route as it was promised: the speed is the route's, the rest is told.
[[nodiscard]] std::string drive_command(const OptimizeJob& job);
/// The taught route and the optimised one side by side.
[[nodiscard]] std::string to_text(const OptimizedRoute& found);
/// The same of a report, with the file and the command that drives it.
[[nodiscard]] std::string to_text(const OptimizeJob& job, const OptimizeReport& report);
[[nodiscard]] ReportFields fields(const OptimizeReport& report);
[[nodiscard]] ReportFields fields(const RouteFigures& figures);

}  // namespace waymark
