#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "waymark/app/cli/console.hpp"
#include "waymark/app/cli/program.hpp"

namespace {

/// Ends the process. Threads of loaded libraries may run until then, and use static objects of their library
/// (those of Ignition Transport read messages by protobuf). These objects are therefore not destroyed, except
/// where a sanitizer looks for leaks.
[[noreturn]] void end_process(int code) {
#if defined(__has_feature)
#if __has_feature(address_sanitizer)
  std::exit(code);
#endif
#endif
  std::fflush(nullptr);
  std::_Exit(code);
}

}  // namespace

int main(int argc, char** argv) {
  namespace cli = waymark::cli;
  cli::watch_signals();
  const cli::Verb program{
      .name = "waymark",
      .sentence = "Teaches a robot a route once and repeats it, from AprilTags and one camera.",
      .help =
          "`waymark VERB --help` explains a verb with an example. Start here:\n"
          "  waymark demo                                teach, map and replay a lap in simulation\n"
          "  waymark detect --annotate seen photos/      find the tags in a folder of images\n",
      .verbs =
          {
              cli::demo_verb(),       cli::teach_verb(),    cli::map_verb(),      cli::replay_verb(),
              cli::routes_verb(),     cli::optimize_verb(), cli::run_verb(),      cli::stop_verb(),
              cli::explore_verb(),    cli::localize_verb(), cli::report_verb(),   cli::plot_verb(),
              cli::info_verb(),       cli::convert_verb(),  cli::play_verb(),     cli::view_verb(),
              cli::recover_verb(),    cli::world_verb(),    cli::simulate_verb(), cli::samples_verb(),
              cli::robot_sim_verb(),  cli::ros2_verb(),     cli::limo_verb(),     cli::mbot_verb(),
              cli::gazebo_verb(),     cli::robots_verb(),   cli::cameras_verb(),  cli::doctor_verb(),
              cli::commission_verb(), cli::detect_verb(),   cli::evaluate_verb(), cli::calibrate_verb(),
              cli::tags_verb(),
          },
  };
  end_process(cli::run_program(program, std::vector<std::string>(argv + (argc > 0 ? 1 : 0), argv + argc)));
}
