#include "waymark/app/detect/write_samples.hpp"

#include <array>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "waymark/app/detect/sample_pictures.hpp"
#include "waymark/app/map/map_recording.hpp"
#include "waymark/app/teach/teach_lap.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

constexpr const char* kWorld = "circuit24";
constexpr const char* kRobot = "limo";

/// A piece of the folder.
struct Piece {
  const char* name;
  const char* what;
  const char* verb;
};

constexpr std::array kPieces = {
    Piece{"lap.mcap", "a taught lap of the robot limo in the world circuit24, with the truth",
          "waymark info lap.mcap"},
    Piece{"map", "the map and the route of that lap", "waymark replay map --world circuit24"},
    Piece{
        "other.mcap",
        "the same lap by a robot that is not what its file says: 3 and 1 % on the wheels, 0.6 of each turn, "
        "a biased gyro, slow motors, pictures 80 ms late",
        "waymark localize other.mcap --map map -o estimate.mcap"},
    Piece{"pictures", "six photographs of three tags of 0.16 m each; the truth and the lens beside them",
          "waymark detect pictures --camera pictures/camera.yaml --tag-size-m 0.16"},
    Piece{"calibration", "fifteen photographs of a board by the lens of calibration/camera.yaml",
          "waymark calibrate camera calibration --cols 6 --rows 5 --tag-size-m 0.03 -o calibration.yaml"}};

/// A robot like that of the setup, but for what its file cannot know.
RobotSetup other_physics(RobotSetup setup) {
  SimulatedRobotOptions& robot = setup.simulated.robot;
  robot.seed += 1;
  robot.camera_latency_s = 0.08;
  robot.dynamics.speed_lag_s = 0.25;
  robot.dynamics.yaw_rate_lag_s = 0.2;
  robot.dynamics.command_delay_s = 0.1;
  robot.dynamics.yaw_gain = 0.6;
  robot.dynamics.lateral_slip_s = -0.08;
  robot.dynamics.slip_noise_m_s = 0.03;
  robot.sensors.left_wheel_scale = 0.97;
  robot.sensors.right_wheel_scale = 0.99;
  robot.sensors.gyro_bias_rad_s = 0.01;
  robot.sensors.gyro_bias_walk = 0.0006;
  return setup;
}

std::string words_of(std::uint64_t seed) {
  std::string text = fmt::format("Simulated data, written by `waymark samples` with seed {}.\n", seed);
  for (const Piece& piece : kPieces)
    text += fmt::format("\n{}: {}.\n    {}\n", piece.name, piece.what, piece.verb);
  return text;
}

Status taught(const RobotSetup& setup, const fs::path& file, const JobControl& control) {
  const Result<TeachReport> report = teach_lap(setup, {.output = file.string()}, control);
  if (!report) return tl::unexpected(report.error());
  return control.go_on();
}

Status write_all(const SamplesJob& job, const fs::path& folder, const JobControl& control) {
  const Result<RobotSetup> setup = load_setup(kWorld, kRobot, job.seed);
  if (!setup) return tl::unexpected(setup.error());
  Status status = taught(*setup, folder / "lap.mcap", control);
  if (!status) return status;
  const auto map = map_recording({.lap = (folder / "lap.mcap").string(), .folder = folder / "map"}, control);
  if (!map) return tl::unexpected(map.error());
  status = taught(other_physics(*setup), folder / "other.mcap", control);
  if (status) status = write_tag_pictures(folder / "pictures", job.seed);
  if (status) status = control.go_on();
  if (status) status = write_board_pictures(folder / "calibration", job.seed);
  if (status) status = control.go_on();
  return status ? write_text_file(folder / "README.txt", words_of(job.seed)) : status;
}

/// Whether something stands where the folder is to be made.
Status check_place(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder, error) && !error) return {};
  if (!error && fs::is_directory(folder, error) && fs::is_empty(folder, error)) return {};
  return fail(ErrorCode::InvalidArgument, "this folder is not empty, or no folder",
              {.source = folder.string()}, "Give the samples a folder of their own.");
}

Status unwritable(const fs::path& folder, const std::error_code& error) {
  return fail(ErrorCode::Unwritable, "cannot write here: " + error.message(), {.source = folder.string()});
}

/// A folder that is removed with everything in it, unless it was moved away.
class Draft {
 public:
  explicit Draft(fs::path path) : path_(std::move(path)) {}
  Draft(const Draft&) = delete;
  Draft& operator=(const Draft&) = delete;
  ~Draft() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }

 private:
  fs::path path_;
};

}  // namespace

Result<SamplesReport> write_samples(const SamplesJob& job, const JobControl& control) {
  const fs::path folder = fs::path(job.folder).lexically_normal();
  const fs::path target = folder.has_filename() ? folder : folder.parent_path();
  if (Status free = check_place(target); !free) return tl::unexpected(free.error());
  const fs::path draft = target.string() + ".part";
  if (Status free = check_place(draft); !free) return tl::unexpected(free.error());
  const Draft removed(draft);
  std::error_code error;
  for (const char* name : {"pictures", "calibration"})
    if (!error) fs::create_directories(draft / name, error);
  if (error) return tl::unexpected(unwritable(target, error).error());
  if (Status written = write_all(job, draft, control); !written) return tl::unexpected(written.error());
  fs::remove(target, error);  // an empty one
  fs::rename(draft, target, error);
  if (error) return tl::unexpected(unwritable(target, error).error());
  SamplesReport report;
  for (const Piece& piece : kPieces) report.files.emplace_back(piece.name);
  report.files.emplace_back("README.txt");
  return report;
}

std::string to_text(const SamplesReport& report, const SamplesJob& job) {
  std::string text = fmt::format("{}: {}\n", job.folder, fmt::join(report.files, ", "));
  for (const Piece& piece : kPieces) text += fmt::format("  {:<12}{}\n", piece.name, piece.what);
  return text + fmt::format("What reads them: {}\n", (fs::path(job.folder) / "README.txt").string());
}

nlohmann::ordered_json to_json(const SamplesReport& report, const SamplesJob& job) {
  return {{"folder", job.folder}, {"seed", job.seed}, {"files", report.files}};
}

}  // namespace waymark
