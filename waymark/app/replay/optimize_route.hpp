#pragma once

#include <string>
#include <vector>

#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/replay/route_optimizer.hpp"

/// `waymark optimize`: computes a faster or smoother route that stays close to a taught one.
namespace waymark {

struct OptimizeJob {
  std::string folder{};       ///< folder written by `waymark map`
  std::string name = "best";  ///< name of the new route
  OptimizerOptions options{};
  ProfileOptions profile{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.folder, JobField("folder MAP", "Folder that `waymark map` wrote").input().required());
    visit(self.name, JobField("name NAME", "Name of the new route; the taught route is not changed"));
  }
};

/// Reads the optimisation options from a .yaml file.
[[nodiscard]] Result<OptimizerOptions> read_weights(const std::string& path);

struct OptimizeReport {
  std::string name{};  ///< name of the new route
  OptimizedRoute found{};
  std::vector<std::string> files{};    ///< written files
  std::vector<std::string> backups{};  ///< new names of replaced files, which contain a number
};

/// Optimises the route and writes it with its figure, either both files or neither. Existing files with this
/// name are renamed.
[[nodiscard]] Result<OptimizeReport> optimize_route_of(const OptimizeJob& job);
/// The command that replays the optimised route. The route specifies the speed; the command sets the limits.
[[nodiscard]] std::string drive_command(const OptimizeJob& job);
/// A table that compares the taught route with the optimised one.
[[nodiscard]] std::string to_text(const OptimizedRoute& found);
/// The same for a report, including the file and the command that drives the route.
[[nodiscard]] std::string to_text(const OptimizeJob& job, const OptimizeReport& report);
[[nodiscard]] ReportFields fields(const OptimizeReport& report);
[[nodiscard]] ReportFields fields(const RouteFigures& figures);

}  // namespace waymark
