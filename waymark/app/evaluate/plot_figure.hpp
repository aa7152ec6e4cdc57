#pragma once

#include <string>
#include <utility>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/base/fields.hpp"

/// Writes a single figure from a report to a file.
namespace waymark {

struct PlotJob {
  std::vector<std::string> runs{};  ///< recordings, map folders, or a demo folder
  std::string figure{};             ///< if empty, the figures are listed and nothing is written
  std::string output{};             ///< .svg, .png or .pdf; if empty, FIGURE.svg
  bool force = false;               ///< whether an existing file may be replaced

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.runs,
          JobField("runs RUN ...", "Recordings, map folders, or a demo folder").input().required());
    visit(self.figure, JobField("figure NAME", "Name of the figure. Default: list all figures"));
    visit(self.output, JobField("output FILE", "File to write: .svg, .png or .pdf (default: NAME.svg)"));
    visit(self.force, JobField("force", "Replace an existing file"));
  }
};

struct PlotReport {
  /// The name of each figure, and its title with the caption.
  std::vector<std::pair<std::string, std::string>> figures{};
  std::string written{};  ///< path of the written file; empty if there is none
};

/// Draws the figure, or lists the figures available for the runs. Fails if the file exists and `force` is not
/// set, or if the figure is unknown (NotFound at `figure`, with the most similar name as a hint).
[[nodiscard]] Result<PlotReport> plot_figure(const PlotJob& job, const JobControl& control);

/// One line per figure.
[[nodiscard]] std::string to_text(const PlotReport& report);

}  // namespace waymark
