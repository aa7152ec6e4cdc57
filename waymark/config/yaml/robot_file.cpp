#include "waymark/config/yaml/robot_file.hpp"

#include <algorithm>
#include <iterator>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"
#include "waymark/config/exchange/camera_file.hpp"
#include "waymark/config/exchange/camera_formats.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml_fields.hpp"
#include "waymark/config/yaml_tree.hpp"
#include "waymark/samples/mounted_camera.hpp"

namespace waymark {
namespace {

constexpr YamlLimits kRobotLimits{.bytes = std::size_t{1} << 18U, .nodes = 20'000, .depth = 16};

}  // namespace

Result<std::optional<MotionNoise>> parse_robot_motion(std::string_view text, const std::string& source) {
  const Result<YamlNode> tree = parse_yaml(text, source, kRobotLimits);
  if (!tree) return tl::unexpected(tree.error());
  const auto motion = YamlCursor(*tree, source).find("motion");
  if (!motion) return std::optional<MotionNoise>();
  const Result<MotionNoise> noise = read_fields<MotionNoise>(*motion);
  if (!noise) return tl::unexpected(noise.error());
  if (const Status status = check_ranges(*noise); !status) {
    Error error = status.error();
    error.place = {.source = source, .line = motion->place().line, .key = "motion." + error.place.key};
    return tl::unexpected(error);
  }
  return std::optional<MotionNoise>(*noise);
}

Result<std::optional<MotionNoise>> read_robot_motion(const std::filesystem::path& path) {
  const Result<std::string> text = read_text_file(path, kRobotLimits.bytes);
  if (!text) return tl::unexpected(text.error());
  return parse_robot_motion(*text, path.string());
}

namespace {

constexpr internal::EntryCount kCameraCount{.key = "camera_count", .entries = "cameras"};
constexpr double kMaxMetres = 20;  ///< limit for hull, wheels and mounting

/// Reads one part of the file with its required keys.
template <class Read>
Status part(const YamlCursor& root, std::string_view key, const std::vector<std::string>& keys, Read&& read) {
  const Result<YamlCursor> entry = root.at(key);
  if (!entry) return tl::unexpected(entry.error());
  if (Status status = entry->check_keys(keys); !status) return status;
  internal::Numbers value(*entry);
  read(value);
  return value.status();
}

Status read_model(const YamlCursor& root, RobotModel& model) {
  Status status = part(root, "hull", {"front_m", "rear_m", "width_m", "height_m"}, [&](auto& value) {
    model.hull = {.front_m = value.plausible("front_m", kMaxMetres, "m"),
                  .rear_m = value.plausible("rear_m", kMaxMetres, "m"),
                  .width_m = value.plausible("width_m", kMaxMetres, "m"),
                  .height_m = value.plausible("height_m", kMaxMetres, "m")};
  });
  if (!status) return status;
  status =
      part(root, "limits", {"speed_m_s", "yaw_rate_rad_s", "acceleration_m_s2", "yaw_acceleration_rad_s2"},
           [&](auto& value) {
             model.limits = {
                 .speed_m_s = value.plausible("speed_m_s", 50, "m/s"),
                 .yaw_rate_rad_s = value.plausible("yaw_rate_rad_s", 30, "rad/s"),
                 .acceleration_m_s2 = value.plausible("acceleration_m_s2", 200, "m/s^2"),
                 .yaw_acceleration_rad_s2 = value.plausible("yaw_acceleration_rad_s2", 1000, "rad/s^2")};
           });
  if (!status) return status;
  status = part(root, "wheels", {"radius_m", "track_m"}, [&](auto& value) {
    model.wheel_radius_m = value.plausible("radius_m", kMaxMetres, "m");
    model.track_m = value.plausible("track_m", kMaxMetres, "m");
  });
  return status;
}

constexpr const char* kMounting = "camera_mounting";
constexpr const char* kInfo = "camera_info";

/// Reads lens and mounting, either at the root or in an entry of `cameras`.
Result<MountedCamera> read_camera_at(const YamlCursor& entry, std::string name) {
  CameraMounting at;
  Status status =
      part(entry, kMounting, {"x_m", "y_m", "z_m", "roll_deg", "pitch_deg", "yaw_deg"}, [&](auto& value) {
        at = {.x_m = value("x_m"),
              .y_m = value("y_m"),
              .z_m = value("z_m"),
              .roll_rad = to_radians(value("roll_deg")),
              .pitch_rad = to_radians(value("pitch_deg")),
              .yaw_rad = to_radians(value("yaw_deg"))};
      });
  if (status && Eigen::Vector3d(at.x_m, at.y_m, at.z_m).norm() > kMaxMetres)
    status =
        entry.at(kMounting)->fail_here(ErrorCode::InvalidArgument,
                                       fmt::format("implausible distance of {:g} m between camera and robot",
                                                   Eigen::Vector3d(at.x_m, at.y_m, at.z_m).norm()),
                                       "Give the mounting in metres.");
  if (!status) return tl::unexpected(status.error());
  const auto info = entry.read_at(kInfo, &internal::read_camera_info);
  if (!info) return tl::unexpected(info.error());
  return MountedCamera{.name = std::move(name), .camera = info->camera, .base_T_cam = base_T_camera(at)};
}

/// Reads the name of a camera, which is used in topics and frames.
Result<std::string> read_camera_name(const YamlCursor& entry, const std::vector<MountedCamera>& before) {
  Result<std::string> name = entry.read_at("name", &YamlCursor::text);
  if (!name) return name;
  const auto allowed = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; };
  if (name->empty() || name->size() > 40 || !std::ranges::all_of(*name, allowed))
    return entry.at("name")->fail_here(ErrorCode::InvalidArgument,
                                       fmt::format("invalid camera name '{}'", *name),
                                       "Use lower case letters, digits and underscores: front, rear_left.");
  if (std::ranges::find(before, *name, &MountedCamera::name) != before.end())
    return entry.at("name")->fail_here(ErrorCode::InvalidArgument,
                                       fmt::format("duplicate camera name '{}'", *name));
  return name;
}

/// Reads the list of cameras, or a single camera, which needs no name.
Result<std::vector<MountedCamera>> read_robot_cameras(const YamlCursor& root) {
  constexpr std::size_t kMaxCameras = 16;
  std::vector<MountedCamera> cameras;
  const auto list = root.find("cameras");
  if (!list) {
    Result<MountedCamera> only = read_camera_at(root, "cam");
    if (!only) return tl::unexpected(only.error());
    return std::vector<MountedCamera>{std::move(*only)};
  }
  for (const char* single : {kMounting, kInfo}) {
    if (const auto both = root.find(single))
      return both->fail_here(ErrorCode::InvalidArgument, "not allowed together with the list 'cameras'",
                             "Move it into an entry of the list.");
  }
  if (!list->is_sequence() || list->children().empty() || list->children().size() > kMaxCameras)
    return list->fail_here(ErrorCode::InvalidArgument,
                           fmt::format("is not a list of 1 to {} cameras", kMaxCameras),
                           "cameras: [{name: front, camera_mounting: {…}, camera_info: {…}}, …]");
  for (const YamlCursor& entry : list->children()) {
    if (Status status = entry.check_keys({"name", kMounting, kInfo}); !status)
      return tl::unexpected(status.error());
    const Result<std::string> name = read_camera_name(entry, cameras);
    if (!name) return tl::unexpected(name.error());
    Result<MountedCamera> camera = read_camera_at(entry, *name);
    if (!camera) return tl::unexpected(camera.error());
    cameras.push_back(std::move(*camera));
  }
  return cameras;
}

Status check_robot_keys(const YamlCursor& root) {
  Status status = root.check_keys({"name", kCameraCount.key, "hull", "limits", "wheels", kMounting, kInfo,
                                   "cameras", "simulation", "motion", "commissioned", "end"});
  if (!status) return status;
  const auto list = root.find("cameras");
  const std::size_t single = root.find(kMounting) ? 1 : 0;
  return internal::check_end(root, kCameraCount, list ? list->children().size() : single);
}

std::string mounting_line(const SE3& base_T_cam) {
  const CameraMounting mounting = camera_mounting(base_T_cam);
  const auto n = yaml_number;
  return fmt::format(
      "camera_mounting: {{x_m: {}, y_m: {}, z_m: {}, roll_deg: {}, pitch_deg: {}, yaw_deg: {}}}\n",
      n(mounting.x_m), n(mounting.y_m), n(mounting.z_m), n(to_degrees(mounting.roll_rad)),
      n(to_degrees(mounting.pitch_rad)), n(to_degrees(mounting.yaw_rad)));
}

/// A text as an indented block.
std::string indented(const std::string& text) {
  std::string block;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    block += "  " + text.substr(begin, end - begin) + "\n";
    begin = end == std::string::npos ? text.size() : end + 1;
  }
  return block;
}

std::string camera_yaml(const std::string& name, const CameraModel& camera, const SE3& base_T_cam) {
  return mounting_line(base_T_cam) + "camera_info:\n" +
         indented(to_camera_info_yaml({.name = name, .camera = camera}));
}

/// The list of named cameras.
std::string cameras_yaml(const RobotDescription& robot) {
  std::vector<MountedCamera> all = {{robot.camera_name, robot.camera, robot.model.base_T_cam}};
  all.insert(all.end(), robot.more_cameras.begin(), robot.more_cameras.end());
  std::string text = "cameras:\n";
  for (const MountedCamera& each : all)
    text += fmt::format("  - name: {}\n", each.name) +
            indented(indented(camera_yaml(each.name, each.camera, each.base_T_cam)));
  return text;
}

}  // namespace

Result<RobotDescription> parse_robot(std::string_view text, const std::string& source) {
  const Result<YamlNode> tree = parse_yaml(text, source, kRobotLimits);
  if (!tree) return tl::unexpected(tree.error());
  const YamlCursor root(*tree, source);
  Status status = check_robot_keys(root);
  if (!status) return tl::unexpected(status.error());
  const Result<std::string> name = root.read_at("name", &YamlCursor::text);
  if (!name) return tl::unexpected(name.error());
  RobotModel model{.name = *name};
  if (status = read_model(root, model); !status) return tl::unexpected(status.error());
  Result<std::vector<MountedCamera>> cameras = read_robot_cameras(root);
  if (!cameras) return tl::unexpected(cameras.error());
  const MountedCamera& first = cameras->front();
  model.base_T_cam = first.base_T_cam;
  RobotDescription robot{.model = model, .camera = first.camera, .camera_name = first.name};
  robot.more_cameras.assign(std::next(cameras->begin()), cameras->end());
  auto commissioned = parse_commission(text, source);
  if (!commissioned) return tl::unexpected(commissioned.error());
  robot.commissioned = std::move(*commissioned);
  if (const auto motion = parse_robot_motion(text, source); !motion) return tl::unexpected(motion.error());
  if (const auto simulation = root.find("simulation")) {
    const auto options = read_fields<SimulatedRobotOptions>(*simulation);
    if (!options) return tl::unexpected(options.error());
    robot.simulation = *options;
    if (status = check(robot.simulation); !status) {
      Error error = status.error();
      error.place = {
          .source = source, .line = simulation->place().line, .key = "simulation." + error.place.key};
      return tl::unexpected(error);
    }
  }
  return robot;
}

Result<RobotDescription> read_robot(const std::filesystem::path& path) {
  const Result<std::string> text = read_text_file(path, kRobotLimits.bytes);
  if (!text) return tl::unexpected(text.error());
  return parse_robot(*text, path.string());
}

Result<std::string> with_camera_mounting(std::string_view text, const SE3& base_T_cam) {
  const std::string source = "robot.yaml";
  if (const auto robot = parse_robot(text, source); !robot) return tl::unexpected(robot.error());
  std::string changed;
  bool inside = false;  // inside the value, which may span several lines
  bool found = false;   // only the first camera is changed
  std::size_t indent = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size() - 1);
    const std::string_view line = text.substr(0, end + 1);
    text.remove_prefix(end + 1);
    const std::size_t at = std::min(line.find_first_not_of(" -"), line.size());
    const bool begins = !found && line.substr(at).starts_with("camera_mounting:");
    found = found || begins;
    if (begins) indent = at;
    inside = begins || (inside && (at > indent || line.substr(at).starts_with('}')));
    if (begins) changed += std::string(line.substr(0, at)) + mounting_line(base_T_cam);
    if (!inside) changed += line;
  }
  const auto robot = parse_robot(changed, source);
  if (!robot) return tl::unexpected(robot.error());
  if (!(robot->model.base_T_cam.inverse() * base_T_cam).log().isZero(1e-9))
    return fail(ErrorCode::Unsupported, "the layout of the file does not allow an automatic change",
                {.source = source, .key = "camera_mounting"}, "Write camera_mounting on a separate line.");
  return changed;
}

std::string to_yaml(const RobotDescription& robot) {
  const auto& [name, hull, limits, wheel_radius_m, track_m, base_T_cam] = robot.model;
  const bool named = robot.camera_name != "cam" || !robot.more_cameras.empty();
  const auto n = yaml_number;
  const std::string text =
      fmt::format("hull: {{front_m: {}, rear_m: {}, width_m: {}, height_m: {}}}\n", n(hull.front_m),
                  n(hull.rear_m), n(hull.width_m), n(hull.height_m)) +
      fmt::format(
          "limits: {{speed_m_s: {}, yaw_rate_rad_s: {}, acceleration_m_s2: {}, "
          "yaw_acceleration_rad_s2: {}}}\n",
          n(limits.speed_m_s), n(limits.yaw_rate_rad_s), n(limits.acceleration_m_s2),
          n(limits.yaw_acceleration_rad_s2)) +
      fmt::format("wheels: {{radius_m: {}, track_m: {}}}\n", n(wheel_radius_m), n(track_m)) +
      (named ? cameras_yaml(robot) : camera_yaml(name, robot.camera, base_T_cam)) + "simulation:\n" +
      write_fields(robot.simulation, 2);
  return internal::yaml_with_end(fmt::format("name: {}\n", yaml_text(name)), kCameraCount,
                                 1 + robot.more_cameras.size(), text);
}

Result<std::vector<ListedFile>> list_shared(std::string_view folder) {
  const auto share = share_folder();
  if (!share) return tl::unexpected(share.error());
  std::vector<ListedFile> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(*share / folder, error))
    if (entry.path().extension() == ".yaml") files.push_back({entry.path().stem().string(), entry.path()});
  if (error)
    return fail(ErrorCode::NotFound, "cannot list the files: " + error.message(),
                {.source = (*share / folder).string()});
  std::ranges::sort(files, {}, &ListedFile::name);
  return files;
}

std::string leading_comment(std::string_view yaml) {
  std::string text;
  while (yaml.starts_with('#')) {
    const std::size_t end = std::min(yaml.find('\n'), yaml.size());
    std::string_view line = yaml.substr(1, end - 1);
    while (line.starts_with(' ')) line.remove_prefix(1);
    while (line.ends_with(' ') || line.ends_with('\r')) line.remove_suffix(1);
    if (!text.empty() && !line.empty()) text += ' ';
    text += line;
    yaml.remove_prefix(std::min(end + 1, yaml.size()));
  }
  return text;
}

std::string first_sentence(const std::string& text) {
  const std::size_t end = text.find(". ");
  return end == std::string::npos ? text : text.substr(0, end + 1);
}

Result<CommentedRobot> read_commented_robot(const std::filesystem::path& path) {
  constexpr std::size_t kMaxBytes = std::size_t{1} << 20U;
  auto robot = read_robot(path);
  if (!robot) return tl::unexpected(robot.error());
  const auto text = read_text_file(path, kMaxBytes);
  if (!text) return tl::unexpected(text.error());
  return CommentedRobot{std::move(*robot), leading_comment(*text)};
}

Result<RobotDescription> read_named_robot(const std::string& name) {
  const auto path = find_shared("robots", name);
  return path ? read_robot(*path) : tl::unexpected(path.error());
}

}  // namespace waymark
