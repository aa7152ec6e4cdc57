#include "waymark/app/evaluate/plot_figure.hpp"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

#include "waymark/app/common/output_files.hpp"
#include "waymark/app/evaluate/report_page.hpp"
#include "waymark/base/message_text.hpp"

namespace waymark {
namespace {

/// Fails if the output file exists and `force` is not set, or if an option has no effect.
Status check_figure_output(const PlotJob& job, const std::filesystem::path& output) {
  if (job.figure.empty() && !job.output.empty())
    return fail(ErrorCode::InvalidArgument, "no effect without `figure`", {.key = "output"},
                "Set `figure`, or omit `output` to list the figures.");
  if (job.figure.empty() && job.force)
    return fail(ErrorCode::InvalidArgument, "no effect without `figure`", {.key = "force"},
                "Set `figure`, or omit `force` to list the figures.");
  if (job.figure.empty()) return {};
  return check_new_file(output, job.force);
}

Result<std::vector<plot::PageFigure>> figures_of_runs(const PlotJob& job, const JobControl& control) {
  const Result<Runs> runs = read_runs(job.runs, control);
  if (!runs) return tl::unexpected(runs.error());
  const Result<plot::Page> page = report_page(*runs, control);
  if (!page) return tl::unexpected(page.error());
  return figures_of(*page);
}

Error no_such_figure(const PlotJob& job, const std::vector<plot::PageFigure>& figures) {
  std::vector<std::string> names;
  names.reserve(figures.size());
  for (const plot::PageFigure& each : figures) names.push_back(each.name);
  return {ErrorCode::NotFound,
          fmt::format("the runs have no figure '{}'", job.figure),
          {.key = "figure"},
          suggestion(job.figure, names)};
}

}  // namespace

Result<PlotReport> plot_figure(const PlotJob& job, const JobControl& control) {
  const std::filesystem::path output = job.output.empty() ? job.figure + ".svg" : job.output;
  if (const Status free = check_figure_output(job, output); !free) return tl::unexpected(free.error());
  const auto figures = figures_of_runs(job, control);
  if (!figures) return tl::unexpected(figures.error());
  PlotReport report;
  for (const plot::PageFigure& each : *figures)
    report.figures.emplace_back(each.name, each.figure.title + ", " + each.caption);
  if (job.figure.empty()) return report;
  const auto found = std::ranges::find(*figures, job.figure, &plot::PageFigure::name);
  if (found == figures->end()) return tl::unexpected(no_such_figure(job, *figures));
  std::vector<std::string> files;
  const Status written = write_figure(output, found->figure, {output.extension().string()}, files);
  if (!written) return tl::unexpected(written.error());
  report.written = files.front();
  return report;
}

std::string to_text(const PlotReport& report) {
  std::string text;
  for (const auto& [name, about] : report.figures) text += fmt::format("{:<16} {}\n", name, about);
  return text;
}

}  // namespace waymark
