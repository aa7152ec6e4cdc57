#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "waymark/base/job_field.hpp"
#include "waymark/jobs/experiment_summary.hpp"
#include "waymark/jobs/job_control.hpp"
#include "waymark/live/experiment_grid.hpp"

namespace waymark {

struct ExperimentJob {
  std::string grid{};  ///< as read_grid() has it
  std::string output = "experiment";
  bool force = false;  ///< replaces an experiment

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.grid,
          JobField("grid GRID", "What is combined with what (.yaml, keys below)").input().required());
    visit(self.output, JobField("output FOLDER", "Folder for laps, maps and experiment.json"));
    visit(self.force, JobField("force", "Replace an experiment that is in the folder"));
  }
};

/// The grid of a .yaml file, checked; an empty file is an error.
[[nodiscard]] Result<ExperimentGrid> read_grid(const std::string& path);

/// Fails where an experiment was written already, which takes hours, unless it is to be replaced (`force`),
/// and where nothing can be written.
[[nodiscard]] Status check_experiment_folder(const std::filesystem::path& folder, bool force);

/// Teaches, maps and replays everything the grid combines, in folders lap-1, lap-2, … of the folder.
/// Cancelling ends it with what was driven until then.
[[nodiscard]] Result<std::vector<ExperimentRun>> run_grid(const ExperimentGrid& grid,
                                                          const std::filesystem::path& folder,
                                                          const JobControl& control);

struct ExperimentReport {
  nlohmann::ordered_json summaries{};  ///< summaries_of() its runs
  bool all_finished = false;
  Status written{};  ///< experiment.json
};
/// Runs the grid and writes experiment.json into the folder, which check_experiment_folder() was asked about.
[[nodiscard]] Result<ExperimentReport> run_experiment(const ExperimentGrid& grid, const ExperimentJob& job,
                                                      const JobControl& control);

}  // namespace waymark
