#include "waymark/config/robot_file.hpp"

#include <fmt/format.h>

#include "waymark/base/angles.hpp"
#include "waymark/config/camera_file.hpp"
#include "waymark/config/camera_formats.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml_fields.hpp"
#include "waymark/config/yaml_numbers.hpp"
#include "waymark/config/yaml_write.hpp"
#include "waymark/samples/camera_body.hpp"

namespace waymark {
namespace {

constexpr YamlLimits kRobotLimits{.bytes = std::size_t{1} << 18U, .nodes = 20'000, .depth = 16};

/// One part of the file: the keys it must have, and what reads them.
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
    model.hull = {.front_m = value.positive("front_m"),
                  .rear_m = value.positive("rear_m"),
                  .width_m = value.positive("width_m"),
                  .height_m = value.positive("height_m")};
  });
  if (!status) return status;
  status =
      part(root, "limits", {"speed_m_s", "yaw_rate_rad_s", "acceleration_m_s2", "yaw_acceleration_rad_s2"},
           [&](auto& value) {
             model.limits = {.speed_m_s = value.positive("speed_m_s"),
                             .yaw_rate_rad_s = value.positive("yaw_rate_rad_s"),
                             .acceleration_m_s2 = value.positive("acceleration_m_s2"),
                             .yaw_acceleration_rad_s2 = value.positive("yaw_acceleration_rad_s2")};
           });
  if (!status) return status;
  status = part(root, "wheels", {"radius_m", "track_m"}, [&](auto& value) {
    model.wheel_radius_m = value.positive("radius_m");
    model.track_m = value.positive("track_m");
  });
  if (!status) return status;
  return part(root, "camera_mounting", {"x_m", "y_m", "z_m", "roll_deg", "pitch_deg", "yaw_deg"},
              [&](auto& value) {
                model.base_T_cam = base_T_camera({.x_m = value("x_m"),
                                                  .y_m = value("y_m"),
                                                  .z_m = value("z_m"),
                                                  .roll_rad = to_radians(value("roll_deg")),
                                                  .pitch_rad = to_radians(value("pitch_deg")),
                                                  .yaw_rad = to_radians(value("yaw_deg"))});
              });
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

}  // namespace

Result<RobotDescription> parse_robot(std::string_view text, const std::string& source) {
  const Result<YamlNode> tree = parse_yaml(text, source, kRobotLimits);
  if (!tree) return tl::unexpected(tree.error());
  const YamlCursor root(*tree, source);
  Status status = root.check_keys(
      {"name", "hull", "limits", "wheels", "camera_mounting", "camera_info", "simulation", "motion"});
  if (!status) return tl::unexpected(status.error());
  const Result<std::string> name = root.read_at("name", &YamlCursor::text);
  if (!name) return tl::unexpected(name.error());
  RobotModel model{.name = *name};
  if (status = read_model(root, model); !status) return tl::unexpected(status.error());
  const auto camera = root.read_at("camera_info", &internal::read_camera_info);
  if (!camera) return tl::unexpected(camera.error());
  RobotDescription robot{.model = model, .camera = camera->camera};
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
  bool inside = false;  // of the value, which may go over several lines
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size() - 1);
    const std::string_view line = text.substr(0, end + 1);
    text.remove_prefix(end + 1);
    const bool begins = line.starts_with("camera_mounting:");
    inside = begins || (inside && (line.front() == ' ' || line.front() == '}'));
    if (begins) changed += mounting_line(base_T_cam);
    if (!inside) changed += line;
  }
  const auto robot = parse_robot(changed, source);
  if (!robot) return tl::unexpected(robot.error());
  if (!(robot->model.base_T_cam.inverse() * base_T_cam).log().isZero(1e-9))
    return fail(ErrorCode::Unsupported, "the file is written in a way that cannot be changed here",
                {.source = source, .key = "camera_mounting"},
                "Write camera_mounting at the start of a line.");
  return changed;
}

std::string to_yaml(const RobotDescription& robot) {
  const auto& [name, hull, limits, wheel_radius_m, track_m, base_T_cam] = robot.model;
  const auto n = yaml_number;
  return fmt::format("name: {}\n", yaml_text(name)) +
         fmt::format("hull: {{front_m: {}, rear_m: {}, width_m: {}, height_m: {}}}\n", n(hull.front_m),
                     n(hull.rear_m), n(hull.width_m), n(hull.height_m)) +
         fmt::format(
             "limits: {{speed_m_s: {}, yaw_rate_rad_s: {}, acceleration_m_s2: {}, "
             "yaw_acceleration_rad_s2: {}}}\n",
             n(limits.speed_m_s), n(limits.yaw_rate_rad_s), n(limits.acceleration_m_s2),
             n(limits.yaw_acceleration_rad_s2)) +
         fmt::format("wheels: {{radius_m: {}, track_m: {}}}\n", n(wheel_radius_m), n(track_m)) +
         mounting_line(base_T_cam) + "camera_info:\n" +
         indented(to_camera_info_yaml({.name = name, .camera = robot.camera})) + "simulation:\n" +
         write_fields(robot.simulation, 2);
}

}  // namespace waymark
