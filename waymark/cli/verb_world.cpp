#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/detections_json.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/cli/page_files.hpp"
#include "waymark/cli/stage_flags.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/jobs/figure_files.hpp"
#include "waymark/plot/loop_figures.hpp"
#include "waymark/simulation/orbit.hpp"
#include "waymark/simulation/world_check.hpp"

namespace waymark::cli {
namespace {

/// What a good lap keeps.
constexpr double kClearanceMetres = 0.35;
constexpr double kTwoTags = 0.98;

constexpr const char* kWorlds =
    "circuit24, limo-walls, academy-house, mbot-square, or the path of a .yaml file";
/// Tags that people print are between these; anything else is a slip of units.
constexpr double kSmallestTagMetres = 0.01;
constexpr double kLargestTagMetres = 2;

struct CheckArgs {
  std::string world;
  std::string robot_file;
  bool json = false;
};

/// What may be meant, but hardly is.
std::vector<std::string> doubts_about(const World& world) {
  std::vector<std::string> doubts;
  for (const auto& [id, tag] : world.tags.tags) {
    const double size = tag.size_m;
    if (size >= kSmallestTagMetres && size <= kLargestTagMetres) continue;
    doubts.push_back(fmt::format("{} is {:g} m large: {}", to_string(id), size,
                                 size > kLargestTagMetres ? "were millimetres meant? Sizes are in metres"
                                                          : "no camera reads that; sizes are in metres"));
    break;  // once is enough
  }
  return doubts;
}

std::string nearest_tag(const WorldCheck& c) { return c.nearest_tag ? to_string(*c.nearest_tag) : "no tag"; }

nlohmann::ordered_json to_json(const SimulatedStage& s, const WorldCheck& c,
                               const std::vector<std::string>& doubts, bool good) {
  return {{"world", s.world.name},
          {"robot", s.model.name},
          {"tags", s.world.tags.tags.size()},
          {"lap_m", c.lap_m},
          {"min_clearance_m", c.min_clearance_m},
          {"nearest_tag", nearest_tag(c)},
          {"two_tags_fraction", c.two_tags_fraction},
          {"fewest_tags", c.fewest_tags},
          {"sharpest_left_1_m", c.sharpest_left_1_m},
          {"sharpest_right_1_m", c.sharpest_right_1_m},
          {"warnings", doubts},
          {"good", good}};
}

ExitCode check(const CheckArgs& args, Console& console) {
  const Result<Stage> stage = load_stage(args.world, args.robot_file, 1);
  if (!stage) {
    console.say(stage.error());
    return ExitCode::Usage;
  }
  const SimulatedStage& s = stage->simulated;
  const Result<WorldCheck> c = check_world(s.world, s.model, s.camera, s.robot.tag_camera);
  if (!c) {
    console.say(c.error());
    return ExitCode::SomeFailed;
  }
  const std::string nearest = nearest_tag(*c);
  const std::vector<std::string> doubts = doubts_about(s.world);
  for (const std::string& doubt : doubts) console.say("warning: " + doubt);
  const bool good =
      doubts.empty() && c->min_clearance_m >= kClearanceMetres && c->two_tags_fraction >= kTwoTags;
  if (args.json) {
    console.print(json_line(to_json(s, *c, doubts, good)));
  } else {
    console.print(fmt::format(
        "{}: {} tags, {} of {:.2f} m, driven by a {} exactly on its line\n"
        "hull to the nearest tag    {:.3f} m ({} from x {:.2f} m, y {:.2f} m; a good lap keeps {} m)\n"
        "two tags or more in view   {:.1f} % of the way (a good lap: {:.0f} %); never fewer than {}\n"
        "sharpest curves            {:.2f} 1/m to the left, {:.2f} 1/m to the right\n",
        s.world.name, s.world.tags.tags.size(), s.world.path_closed ? "a lap" : "a way", c->lap_m,
        s.model.name, c->min_clearance_m, nearest, c->nearest_place_m.x(), c->nearest_place_m.y(),
        kClearanceMetres, 100 * c->two_tags_fraction, 100 * kTwoTags, c->fewest_tags, c->sharpest_left_1_m,
        c->sharpest_right_1_m));
  }
  if (!good) console.say("this world does not allow a good lap");
  return good ? ExitCode::Ok : ExitCode::SomeFailed;
}

Run prepare_check(CLI::App& app) {
  const auto args = std::make_shared<CheckArgs>();
  app.add_option("WORLD", args->world, kWorlds)->required()->type_name("");
  app.add_option("--robot-file", args->robot_file,
                 "Body and camera of the robot: limo, limo-ackermann, limo-stock-driver, mbot, "
                 "turtlebot3-waffle, or the "
                 "path of a .yaml file. Unless given: the robot that the world names, or limo")
      ->type_name("NAME");
  app.add_flag("--json", args->json, "One JSON object instead of words");
  return [args](Console& console) { return check(*args, console); };
}

struct OrbitArgs {
  explicit OrbitArgs(CLI::App& app) : options(app, "Noise") {}

  std::string world;
  std::string output;
  bool json = false;
  OptionFlags<OrbitOptions> options;
};

Trajectory as_trajectory(const std::vector<SE3>& poses) {
  Trajectory trajectory;
  for (const SE3& pose : poses) trajectory.push_back({SensorTime(Duration(trajectory.size())), pose});
  if (!trajectory.empty()) trajectory.push_back(trajectory.front());  // the circle is closed
  return trajectory;
}

/// Where the camera looks: its z axis, as a stroke every thirty degrees.
plot::Series view_axes(const std::vector<SE3>& map_T_cam, double length_m, plot::Color color) {
  plot::Series series{.name = "", .color = color};
  for (std::size_t i = 0; i < map_T_cam.size(); i += std::max<std::size_t>(map_T_cam.size() / 12, 1)) {
    for (const double z : {0.0, length_m, std::nan("")}) {
      const Eigen::Vector3d p = map_T_cam[i] * Eigen::Vector3d(0, 0, z);
      series.x.push_back(p.x());
      series.y.push_back(p.y());
    }
  }
  return series;
}

Status write_orbit(const std::string& path, const World& world, const OrbitReport& report) {
  plot::Figure figure =
      plot::path_figure("A camera on a circle about the tags",
                        {{"as placed", as_trajectory(report.map_T_cam), world.tags, plot::kTruthColor},
                         {"composed, with noise", as_trajectory(report.map_T_cam_composed),
                          report.tags_composed, plot::kEstimateColor}});
  figure.series.push_back(view_axes(report.map_T_cam, report.radius_m / 8, plot::kTruthColor));
  figure.series.push_back(view_axes(report.map_T_cam_composed, report.radius_m / 8, plot::kEstimateColor));
  const Result<plot::FileFormat> format = plot::format_of(path);
  if (!format) return tl::unexpected(format.error());
  std::vector<std::string> files;
  return write_figure(path, figure, {std::filesystem::path(path).extension().string()}, files);
}

std::string to_text(const World& world, const OrbitReport& r) {
  const auto verdict = [](bool good) { return good ? "yes" : "NO"; };
  return fmt::format(
      "{}: {} steps on a circle of {:.2f} m about {} tags\n"
      "without noise  compositions close to {:.1e} (below 1e-12: {})\n"
      "with noise     largest jump {:.3f} m of {:.3f} m that the noise explains, {:.2f} of {:.2f} deg (no "
      "discontinuity: {})\n"
      "               smallest cosine of an axis with its nominal one {:.4f} (no inversion: {})\n",
      world.name, r.map_T_cam.size(), r.radius_m, world.tags.tags.size(), r.closure, verdict(r.closes()),
      r.jump_m, r.jump_limit_m, r.jump_deg, r.jump_limit_deg, verdict(r.continuous()), r.smallest_axis_cosine,
      verdict(r.upright()));
}

nlohmann::ordered_json to_json(const World& world, const OrbitReport& r) {
  return {{"world", world.name},
          {"steps", r.map_T_cam.size()},
          {"radius_m", r.radius_m},
          {"closure", r.closure},
          {"jump_m", r.jump_m},
          {"jump_limit_m", r.jump_limit_m},
          {"jump_deg", r.jump_deg},
          {"jump_limit_deg", r.jump_limit_deg},
          {"smallest_axis_cosine", r.smallest_axis_cosine},
          {"good", r.closes() && r.continuous() && r.upright()}};
}

ExitCode go_round(const OrbitArgs& args, Console& console) {
  OrbitOptions options;
  Status status = args.options.apply(options);
  const Result<Stage> stage = load_stage(args.world, {}, 1);
  if (status && !stage) status = tl::unexpected(stage.error());
  if (!status) {
    console.say(status.error());
    return ExitCode::Usage;
  }
  const World& world = stage->simulated.world;
  const Result<OrbitReport> report = orbit(world, options);
  if (!report) {
    console.say(report.error());
    return ExitCode::SomeFailed;
  }
  console.print(args.json ? json_line(to_json(world, *report)) : to_text(world, *report));
  if (!args.output.empty()) {
    if (status = write_orbit(args.output, world, *report); !status) {
      console.say(naming_flag(status.error()));
      return ExitCode::SomeFailed;
    }
  }
  return report->closes() && report->continuous() && report->upright() ? ExitCode::Ok : ExitCode::SomeFailed;
}

Run prepare_orbit(CLI::App& app) {
  const auto args = std::make_shared<OrbitArgs>(app);
  app.add_option("WORLD", args->world, kWorlds)->required()->type_name("");
  app.add_option("-o,--output", args->output, "Also draw it (.svg, .png or .pdf)")->type_name("FILE");
  app.add_flag("--json", args->json, "One JSON object instead of words");
  return [args](Console& console) { return go_round(*args, console); };
}

Verb check_verb() {
  return {
      .name = "check",
      .sentence = "Whether a robot can drive a good lap in a world",
      .help =
          R"(Drives the world's line exactly, without noise, and looks: how near the hull comes to a tag, and from how
much of the way the camera sees two tags or more.

Exit code: 0 a good lap is possible, 1 it is not, 2 wrong usage or a world that cannot be read.

Examples:
  waymark world check circuit24
  waymark world check circuit24 --robot-file limo --json
)",
      .prepare = prepare_check,
      .verbs = {}};
}

Verb orbit_verb() {
  return {
      .name = "orbit",
      .sentence = "Validate frames and axes with a camera that goes round the tags",
      .help =
          R"(After Martins and Ramos, "AprilTag-based Trajectory Tracking for the LIMOS Robot", section 3.1. A nominal
camera goes round all tags on a circle and looks at their middle. Without noise the camera through the
anchor (equation 3.1), every tag through the camera, and every way round must close; with noise on camera
and tags the composed frames may neither jump nor turn an axis over.

Exit code: 0 all of it holds, 1 it does not, 2 wrong usage or a world that cannot be read.

Examples:
  waymark world orbit circuit24
  waymark world orbit circuit24 -o orbit.svg --sigma-m 0.01 --sigma-deg 1
)",
      .prepare = prepare_orbit,
      .verbs = {}};
}

}  // namespace

Verb world_verb() {
  return {.name = "world",
          .sentence = "Look at a simulated world, or make one",
          .help = "Example:\n  waymark world check circuit24\n",
          .prepare = {},
          .verbs = {check_verb(), world_new_verb(), orbit_verb()}};
}

}  // namespace waymark::cli
