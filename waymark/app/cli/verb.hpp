#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "waymark/app/cli/console.hpp"
#include "waymark/app/common/report_fields.hpp"

namespace CLI {
class App;
}

namespace waymark::cli {

/// Runs a verb after the command line has been parsed.
using Run = std::function<ExitCode(Console&)>;

/// A verb on the command line. It can be run (`prepare`), has subverbs (`verbs`), or both. With both, it is
/// run if the next word is not one of `verbs`. If the command line names none of `verbs`, `usual_verb`
/// selects one of them, or a sibling of this verb.
struct Verb {
  std::string name;
  std::string sentence;  ///< description in the list of verbs
  std::string help;      ///< printed at the end of --help: an example with its output, exit codes
  std::function<Run(CLI::App&)> prepare = {};  ///< adds the flags; called once before parsing
  std::function<ReportFields()> report = {};   ///< describes the output of --json, whose keys --help-all
                                               ///< lists
  std::vector<Verb> verbs = {};
  /// Returns the verb (one of `verbs`, or a sibling) that is implied by a command line that names none of
  /// `verbs`. `words` are those that follow this verb ("lap.mcap", "--json").
  std::function<std::string(const std::vector<std::string>& words)> usual_verb = {};
};

/// Whether the words contain a flag, including the form with a value: "--robot=ros2:limo".
[[nodiscard]] bool has_word(const std::vector<std::string>& words, const std::string& flag);

/// The words that are neither flags nor values of flags, based on the flags of `verbs`.
[[nodiscard]] std::vector<std::string> inputs_of(const std::vector<std::string>& words,
                                                 const std::vector<Verb>& verbs);

/// A `prepare` function for a verb whose flags are members of Args. The constructor of Args adds them to the
/// verb.
template <class Args>
[[nodiscard]] std::function<Run(CLI::App&)> prepared(ExitCode (*run)(const Args&, Console&)) {
  return [run](CLI::App& app) -> Run {
    const auto args = std::make_shared<Args>(app);
    return [args, run](Console& console) { return run(*args, console); };
  };
}
/// The same for a verb without flags.
[[nodiscard]] inline std::function<Run(CLI::App&)> prepared(ExitCode (*run)(Console&)) {
  return [run](CLI::App&) -> Run { return run; };
}

/// A `report` function for a verb that prints fields(Report) with --json.
template <IsReport Report>
[[nodiscard]] ReportFields report_of() {
  return fields(Report{});
}
/// The same for a verb whose --json prints one of several reports. Each key is listed once, with the sentence
/// from the first report that has it.
template <IsReport... Reports>
[[nodiscard]] ReportFields report_of_any() {
  ReportFields all;
  for (const ReportFields& one : {fields(Reports{})...})
    for (const ReportField& field : one)
      if (std::ranges::find(all, field.name, &ReportField::name) == all.end()) all.push_back(field);
  return all;
}

// Each verb is declared on one line; main.cpp lists them.

[[nodiscard]] Verb detect_verb();
[[nodiscard]] Verb cameras_verb();
[[nodiscard]] Verb commission_verb();
[[nodiscard]] Verb doctor_verb();
[[nodiscard]] Verb evaluate_verb();
[[nodiscard]] Verb calibrate_verb();
[[nodiscard]] Verb calibrate_camera_verb();
[[nodiscard]] Verb calibrate_guided_verb();
[[nodiscard]] Verb calibrate_robot_verb();
[[nodiscard]] Verb evaluate_detections_verb();
[[nodiscard]] Verb demo_verb();
[[nodiscard]] Verb teach_verb();
[[nodiscard]] Verb map_verb();
[[nodiscard]] Verb map_convert_verb();
[[nodiscard]] Verb map_lap_verb();
[[nodiscard]] Verb map_scene_verb();
[[nodiscard]] Verb map_video_verb();
[[nodiscard]] Verb replay_verb();
[[nodiscard]] Verb routes_verb();
[[nodiscard]] Verb optimize_verb();
[[nodiscard]] Verb localize_verb();
[[nodiscard]] Verb localize_log_verb();
[[nodiscard]] Verb localize_robot_verb();
[[nodiscard]] Verb localize_camera_verb();
[[nodiscard]] Verb localize_video_verb();
[[nodiscard]] Verb report_verb();
[[nodiscard]] Verb plot_verb();
[[nodiscard]] Verb info_verb();
[[nodiscard]] Verb convert_verb();
[[nodiscard]] Verb play_verb();
[[nodiscard]] Verb view_verb();
[[nodiscard]] Verb recover_verb();
[[nodiscard]] Verb world_verb();
[[nodiscard]] Verb simulate_verb();
[[nodiscard]] Verb samples_verb();
[[nodiscard]] Verb robot_sim_verb();
[[nodiscard]] Verb robot_sim_process_verb();
[[nodiscard]] Verb robot_sim_ros2_verb();
[[nodiscard]] Verb robot_sim_limo_verb();
[[nodiscard]] Verb robot_sim_mbot_verb();
[[nodiscard]] Verb robot_sim_gazebo_verb();
[[nodiscard]] Verb mbot_verb();
[[nodiscard]] Verb robots_verb();
[[nodiscard]] Verb gazebo_verb();
[[nodiscard]] Verb ros2_verb();
[[nodiscard]] Verb limo_verb();
[[nodiscard]] Verb ros2_topic_verb();
[[nodiscard]] Verb explore_verb();
[[nodiscard]] Verb run_verb();
[[nodiscard]] Verb stop_verb();
[[nodiscard]] Verb world_check_verb();
[[nodiscard]] Verb world_from_recording_verb();
[[nodiscard]] Verb world_export_verb();
[[nodiscard]] Verb world_import_verb();
[[nodiscard]] Verb world_new_verb();
[[nodiscard]] Verb world_orbit_verb();
[[nodiscard]] Verb tags_verb();
[[nodiscard]] Verb tags_sheet_verb();
[[nodiscard]] Verb tags_board_verb();

}  // namespace waymark::cli
