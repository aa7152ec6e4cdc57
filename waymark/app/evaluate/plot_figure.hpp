#pragma once

#include <string>
#include <utility>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/base/fields.hpp"

/// Writes one figure of a report to a file.
namespace waymark {

struct PlotJob {
  std::vector<std::string> runs{};  ///< recordings, map folders, or a demo folder
  std::string figure{};             ///< empty: list the figures, write nothing
  std::string output{};             ///< .svg, .png or .pdf; empty: FIGURE.svg
  bool force = false;               ///< replace an existing file

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
  std::vector<std::pair<std::string, std::string>> figures{};  ///< name; title and caption
  std::string written{};                                       ///< file; empty: none
};

/// Draws the figure, or lists the figures of the runs. Fails on an existing file unless `force` is set, and
/// on an unknown figure (NotFound at `figure`, with the most similar name as hint).
[[nodiscard]] Result<PlotReport> plot_figure(const PlotJob& job, const JobControl& control);

/// One line per figure.
[[nodiscard]] std::string to_text(const PlotReport& report);

}  // namespace waymark
