#include "waymark/app/samples/write_samples.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <numbers>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "waymark/app/calibrate_camera/calibrate_camera.hpp"
#include "waymark/app/map/map_recording.hpp"
#include "waymark/app/teach/teach_lap.hpp"
#include "waymark/base/error.hpp"
#include "waymark/base/random.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/config/exchange/camera_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/simulation/render/photograph.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

/// The board drawn by write_board_images(); the command in kPieces contains the same values.
constexpr int kSampleBoardColumns = 6;
constexpr int kSampleBoardRows = 5;
constexpr double kSampleBoardTag_m = 0.03;
/// Size of the tags drawn by write_tag_images().
constexpr double kSampleTag_m = 0.16;

constexpr int kTagImages = 6;
constexpr int kBoardImages = 15;

/// A 640 x 480 webcam with barrel distortion.
Result<CameraModel> sample_lens() {
  const PinholeRadtan lens{.fx = 612.4,
                           .fy = 611.1,
                           .cx = 325.7,
                           .cy = 236.2,
                           .k = {-0.24, 0.07, 0.0006, -0.0004},
                           .coefficients = 4};
  return CameraModel::make(lens, 640, 480);
}

Status write_lens(const fs::path& folder, const CameraModel& lens) {
  return write_text_file(folder / "camera.yaml", to_camera_info_yaml({.name = "samples", .camera = lens}));
}

nlohmann::ordered_json to_json(const TagTruth& truth) {
  nlohmann::ordered_json corners = nlohmann::ordered_json::array();
  for (const Eigen::Vector2d& corner : truth.corners_px) corners.push_back({corner.x(), corner.y()});
  const Eigen::Vector3d& at = truth.cam_T_tag.translation();
  const Eigen::Quaterniond& turned = truth.cam_T_tag.rotation().quaternion();
  return {{"tag", to_string(truth.tag)},
          {"size_m", truth.size_m},
          {"corners_px", corners},
          {"position_m", {at.x(), at.y(), at.z()}},
          {"quaternion_xyzw", {turned.x(), turned.y(), turned.z(), turned.w()}}};
}

/// Three tags side by side, at different distances and orientations.
PhotographScene three_tags(int image, Random& random) {
  PhotographScene scene;
  for (int place = 0; place < 3; ++place) {
    const double away_m = random.uniform(1.1, 2.2);
    const double turn_rad = random.uniform(-0.8, 0.8);
    const double nod_rad = random.uniform(-0.3, 0.3);
    const double roll_rad = random.uniform(-0.2, 0.2);
    const double up_m = random.uniform(-0.15, 0.15) * away_m;
    const SE3 cam_T_tag(SO3::from_rpy(nod_rad, turn_rad, roll_rad),
                        {0.3 * (place - 1) * away_m, up_m, away_m});
    scene.tags.push_back({{FamilyId::Tag36h11, 3 * image + place}, cam_T_tag, kSampleTag_m});
  }
  return scene;
}

/// The board at various angles and distances, in all parts of the image.
SE3 cam_T_board_of(int image, Random& random) {
  const double about = 2 * std::numbers::pi * image * 4 / kBoardImages;
  const double tilt_rad = image % 5 == 0 ? 0.05 : 0.55;
  const double roll_rad = random.uniform(-0.3, 0.3);
  const double away_m = random.uniform(0.27, 0.45);
  const SO3 tilted = SO3::exp({tilt_rad * std::cos(about), tilt_rad * std::sin(about), roll_rad});
  return {tilted, {0.16 * away_m * std::cos(1.7 * image), 0.12 * away_m * std::sin(1.7 * image), away_m}};
}

/// Writes six images with three tags each, 1.png to 6.png, and the camera model, camera.yaml. The file
/// truth.json contains the tags in each image with their corners [px] and their poses in the camera frame [m,
/// quaternion x y z w].
Status write_tag_images(const fs::path& folder, std::uint64_t seed) {
  const Result<CameraModel> lens = sample_lens();
  if (!lens) return tl::unexpected(lens.error());
  Random random(seed);
  nlohmann::ordered_json truths = nlohmann::ordered_json::object();
  for (int image = 0; image < kTagImages; ++image) {
    const auto taken = photograph(*lens, three_tags(image, random), {}, random);
    if (!taken) return tl::unexpected(taken.error());
    const std::string name = fmt::format("{}.png", image + 1);
    for (const TagTruth& truth : taken->tags) truths[name].push_back(to_json(truth));
    if (Status written = write_image(folder / name, taken->image); !written) return written;
  }
  Status written = write_text_file(folder / "truth.json", truths.dump(1) + "\n");
  return written ? write_lens(folder, *lens) : written;
}

/// Writes fifteen images of a board with 6 x 5 tags, 01.png to 15.png, using the camera model in camera.yaml.
Status write_board_images(const fs::path& folder, std::uint64_t seed) {
  const Result<CameraModel> lens = sample_lens();
  const Result<CalibrationTarget> target = CalibrationTarget::make(
      {.columns = kSampleBoardColumns, .rows = kSampleBoardRows, .tag_size_m = kSampleBoardTag_m});
  if (!lens) return tl::unexpected(lens.error());
  if (!target) return tl::unexpected(target.error());
  const TagMap& board = target->tags();
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const auto& [tag, mapped] : board.tags)
    middle += mapped.map_T_tag.translation() / static_cast<double>(board.tags.size());
  Random random(seed);
  for (int image = 0; image < kBoardImages; ++image) {
    const SE3 cam_T_board = cam_T_board_of(image, random) * SE3(SO3(), -middle);
    PhotographScene scene;
    for (const auto& [tag, mapped] : board.tags)
      scene.tags.push_back({tag, cam_T_board * mapped.map_T_tag, mapped.size_m, 0.3});
    const auto taken = photograph(*lens, scene, {}, random);
    if (!taken) return tl::unexpected(taken.error());
    if (Status written = write_image(folder / fmt::format("{:02}.png", image + 1), taken->image); !written)
      return written;
  }
  return write_lens(folder, *lens);
}

constexpr const char* kWorld = "circuit24";
constexpr const char* kRobot = "limo";

/// One item of sample data in the folder.
struct Piece {
  const char* name;
  const char* what;
  const char* verb;
};

constexpr std::array kPieces = {
    Piece{"lap.mcap", "a taught lap of the robot limo in the world circuit24, with ground truth",
          "waymark info lap.mcap"},
    Piece{"map", "the map and the route of that lap", "waymark replay map world=circuit24"},
    Piece{"other.mcap",
          "the same lap by a robot that differs from its file: wheel scales 3 and 1 % too small, turn gain "
          "0.6, "
          "gyro bias, slow motors, camera latency 80 ms",
          "waymark localize other.mcap map=map output=estimate.mcap"},
    Piece{"images", "six images of three tags of 0.16 m each, with ground truth and camera model",
          "waymark detect images camera=images/camera.yaml tag_size_m=0.16"},
    Piece{"calibration", "fifteen images of a board with the camera model of calibration/camera.yaml",
          "waymark calibrate camera calibration cols=6 rows=5 tag_size_m=0.03 output=calibration.yaml"}};

/// The robot of the setup, with errors that its robot file does not describe.
RobotSetup other_physics(RobotSetup setup) {
  SimulatedRobotOptions& robot = setup.simulated.robot;
  robot.seed += 1;
  robot.camera_latency_s = 0.08;
  robot.dynamics.speed_lag_s = 0.25;
  robot.dynamics.yaw_rate_lag_s = 0.2;
  robot.dynamics.command_delay_s = 0.1;
  robot.dynamics.turn_gain = 0.6;
  robot.dynamics.lateral_slip_s = -0.08;
  robot.dynamics.slip_noise_m_s = 0.03;
  robot.sensors.left_wheel_scale = 0.97;
  robot.sensors.right_wheel_scale = 0.99;
  robot.sensors.gyro_bias_rad_s = 0.01;
  robot.sensors.gyro_bias_walk = 0.0006;
  return setup;
}

std::string readme_of(std::uint64_t seed, const JobControl& control) {
  std::string text = fmt::format("Simulated data, written by `waymark samples` with seed {}.\n", seed);
  for (const Piece& piece : kPieces) {
    const std::string quoted = control.for_users(fmt::format("`{}`", piece.verb));
    text += fmt::format("\n{}: {}.\n    {}\n", piece.name, piece.what, quoted.substr(1, quoted.size() - 2));
  }
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
  if (status) status = write_tag_images(folder / "images", job.seed);
  if (status) status = control.go_on();
  if (status) status = write_board_images(folder / "calibration", job.seed);
  if (status) status = control.go_on();
  return status ? write_text_file(folder / "README.txt", readme_of(job.seed, control)) : status;
}

/// Fails if the folder exists and is not empty.
Status check_place(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder, error) && !error) return {};
  if (!error && fs::is_directory(folder, error) && fs::is_empty(folder, error)) return {};
  return fail(ErrorCode::InvalidArgument, "exists and is not an empty folder", {.source = folder.string()},
              "Choose a new folder for the samples.");
}

Status unwritable(const fs::path& folder, const std::error_code& error) {
  return fail(ErrorCode::Unwritable, "cannot write into this folder: " + error.message(),
              {.source = folder.string()}, "Choose another folder for the samples.");
}

/// Removes a folder with its content, unless it has been renamed.
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
  for (const char* name : {"images", "calibration"})
    if (!error) fs::create_directories(draft / name, error);
  if (error) return tl::unexpected(unwritable(target, error).error());
  if (Status written = write_all(job, draft, control); !written) return tl::unexpected(written.error());
  fs::remove(target, error);  // only removes an empty folder
  fs::rename(draft, target, error);
  if (error) return tl::unexpected(unwritable(target, error).error());
  SamplesReport report{.folder = job.folder, .seed = job.seed};
  for (const Piece& piece : kPieces) report.files.emplace_back(piece.name);
  report.files.emplace_back("README.txt");
  return report;
}

std::string to_text(const SamplesReport& report) {
  std::string text = fmt::format("{}: {}\n", report.folder, fmt::join(report.files, ", "));
  for (const Piece& piece : kPieces) text += fmt::format("  {:<12}{}\n", piece.name, piece.what);
  return text + fmt::format("Commands for them: {}\n", (fs::path(report.folder) / "README.txt").string());
}

ReportFields fields(const SamplesReport& report) {
  return {{"folder", "Written folder", report.folder},
          {"seed", "Seed of all noise", report.seed},
          {"files", "Names of the files and folders in it", report.files}};
}

}  // namespace waymark
