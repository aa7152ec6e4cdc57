#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/tag_size_flags.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/live/doctor.hpp"
#include "waymark/live/doctor_network.hpp"
#include "waymark/live/robot_kinds.hpp"

namespace waymark::cli {
namespace {

struct DoctorArgs {
  std::string robot{};
  std::string calibration{};
  std::vector<std::string> sources{};
  std::string folder = ".";
  LoopTrial trial{};
  std::unique_ptr<TagSizeFlags> tag{};
  bool json = false;
};

/// What was named, else what is in the current folder.
std::string calibration_file(const DoctorArgs& args) {
  std::error_code ignored;
  const std::string found = std::filesystem::exists("calibration.yaml", ignored) ? "calibration.yaml" : "";
  return args.calibration.empty() ? found : args.calibration;
}

void add_calibration(const std::string& file, std::vector<DoctorLine>& lines) {
  lines.push_back(file.empty() ? DoctorLine{"calibration", DoctorLevel::Warn,
                                            "no calibration was named, and there is no calibration.yaml here",
                                            "waymark doctor --camera FILE"}
                               : check_calibration(file, std::filesystem::file_time_type::clock::now()));
}

Result<std::vector<DoctorLine>> check_all(const DoctorArgs& args) {
  std::vector<DoctorLine> lines = check_cameras(list_cameras());
  if (!args.robot.empty()) {
    auto found = check_robot(args.robot);
    if (!found) return tl::unexpected(found.error());
    lines.insert(lines.begin(), found->begin(), found->end());
  }
  for (DoctorLine& line : check_devices()) lines.push_back(std::move(line));
  for (const std::string& source : args.sources) lines.push_back(check_live_camera(source));
  const std::string calibration = calibration_file(args);
  add_calibration(calibration, lines);
  for (DoctorLine& line : args.tag->check(args.sources, calibration)) lines.push_back(std::move(line));
  lines.push_back(check_disk(args.folder));
  const auto finder = make_tag_finder();
  if (!finder) return tl::unexpected(finder.error());
  const auto tried = try_loop(*finder, args.trial);
  if (!tried) return tl::unexpected(tried.error());
  lines.push_back(check_processor(args.trial, *tried));
  return lines;
}

ExitCode examine(const DoctorArgs& args, Console& console) {
  const auto lines = check_all(args);
  if (!lines) {
    const bool usage = lines.error().code == ErrorCode::InvalidArgument;
    return console.failed(lines.error(), usage ? ExitCode::Usage : ExitCode::SomeFailed);
  }
  auto list = nlohmann::ordered_json::array();
  for (const DoctorLine& line : *lines) {
    list.push_back({{"check", line.key},
                    {"level", to_string(line.level)},
                    {"words", line.words},
                    {"command", line.command}});
    if (args.json) continue;
    console.print(fmt::format("{:<5} {:<12} {}\n", to_string(line.level), line.key, line.words));
    if (!line.command.empty()) console.print(fmt::format("{:<19}{}\n", "", line.command));
  }
  if (args.json) console.print(json_line({{"checks", list}}));
  return std::ranges::find(*lines, DoctorLevel::Fail, &DoctorLine::level) == lines->end()
             ? ExitCode::Ok
             : ExitCode::SomeFailed;
}

Run prepare_doctor(CLI::App& app) {
  const auto args = std::make_shared<DoctorArgs>();
  app.add_option("--robot", args->robot,
                 "Robot to listen to, without moving it: limo:PORT, mbot:ADDRESS, ros2:PROFILE or "
                 "gazebo:PROFILE, for example limo:/dev/ttyTHS1")
      ->type_name("NAME");
  app.add_option("--camera", args->calibration,
                 "Calibration to look at. Unless given: calibration.yaml in the current folder, if there is "
                 "one")
      ->type_name("FILE");
  app.add_option("--camera-source", args->sources,
                 "Camera to open and to take pictures from for a second, for example v4l2:/dev/video0")
      ->type_name("ADDRESS");
  args->tag = std::make_unique<TagSizeFlags>(app);
  app.add_option("--folder", args->folder, "Folder in which recordings will be written")
      ->capture_default_str()
      ->type_name("PATH");
  app.add_option("--width-px", args->trial.width, "Width of the pictures of the trial")
      ->capture_default_str()
      ->check(CLI::Range(64, 8192))
      ->type_name("INTEGER");
  app.add_option("--height-px", args->trial.height, "Height of the pictures of the trial")
      ->capture_default_str()
      ->check(CLI::Range(64, 8192))
      ->type_name("INTEGER");
  app.add_option("--rate-hz", args->trial.rate_hz, "Rate of the pictures of the trial")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 1000.0))
      ->type_name("FLOAT");
  app.add_flag("--json", args->json, "One JSON object instead of lines");
  return [args](Console& console) { return examine(*args, console); };
}

}  // namespace

Verb doctor_verb() {
  return {
      .name = "doctor",
      .sentence = "Check robot, cameras, calibration, disk and processor before a drive",
      .help =
          R"(One line a check: ok, warn or fail, what was found, and below it the command that mends it or tells more.
Cameras: each device, whether this user may open it, and who uses it. Calibration: age, and what it could not
tell. Robot: its port (is it there, who may open it, who has it) or its network (peers, qualities of service), the
rate of its odometry, the difference of its clock, who else commands it, battery, errors. Devices: serial ports and
gamepads, and whether this user may open them. Disk: the room for recordings. Processor: the loop of a robot runs for two seconds on drawn pictures.

Exit code: 0 nothing failed, 1 a check failed, 2 wrong usage.

Examples:
  waymark doctor
  waymark doctor --robot ros2:limo
  waymark doctor --camera calibration.yaml --camera-source v4l2:/dev/video0 --rate-hz 60
  waymark doctor --camera calibration.yaml --camera-source v4l2:/dev/video0 --tag-at-m 1 --tag-size-m 0.16
)",
      .prepare = prepare_doctor,
      .verbs = {}};
}

}  // namespace waymark::cli
