#include "waymark/config/map_exchange.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"
#include "waymark/config/fmap_layout.hpp"
#include "waymark/config/map_exchange_read.hpp"
#include "waymark/config/wpilib_layout.hpp"
#include "waymark/config/yaml_write.hpp"
#include "waymark/geometry/uncertainty.hpp"

namespace waymark {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;

std::string xyz(const char* key, const Eigen::Vector3d& v, const std::string& indent) {
  return fmt::format("{0}{1}:\n{0}  x: {2}\n{0}  y: {3}\n{0}  z: {4}\n", indent, key, yaml_number(v.x()),
                     yaml_number(v.y()), yaml_number(v.z()));
}

/// Heading of a robot that looks straight at the tag, and the middle of its board.
std::string academy_yaml(const MapFile& map, std::vector<std::string>& warnings) {
  constexpr double kLeans = 0.05;
  constexpr double kHalfBoard = 0.01;
  std::string text = "tags:\n";
  for (const auto& [id, tag] : map.tags.tags) {
    const Eigen::Vector3d into = tag.map_T_tag.rotation() * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d down = tag.map_T_tag.rotation() * Eigen::Vector3d::UnitY();
    if (std::abs(into.z()) > kLeans || std::abs(down.z() + 1) > kLeans)
      warnings.push_back(to_string(id) + " does not hang upright, and this form cannot say so");
    const double yaw = std::atan2(into.y(), into.x());
    const Eigen::Vector3d p =
        tag.map_T_tag.translation() + kHalfBoard * Eigen::Vector3d(std::cos(yaw), std::sin(yaw), 0);
    text += fmt::format("  tag_{}:\n    position: {}\n", id.number,
                        yaml_list(std::vector{p.x(), p.y(), p.z(), yaw}));
  }
  return text;
}

std::string tagslam_yaml(const MapFile& map) {
  const SE3 half_turn(SO3::exp(Eigen::Vector3d(std::numbers::pi, 0, 0)), Eigen::Vector3d::Zero());
  std::string text = "bodies:\n - lab:\n     type: simple\n     is_static: true\n     pose:\n" +
                     xyz("position", Eigen::Vector3d::Zero(), "       ") +
                     xyz("rotation", Eigen::Vector3d::Zero(), "       ") +
                     xyz("position_noise", Eigen::Vector3d::Constant(1e-6), "       ") +
                     xyz("rotation_noise", Eigen::Vector3d::Constant(1e-6), "       ") + "     tags:\n";
  for (const auto& [id, tag] : map.tags.tags) {
    const SE3 pose = tag.map_T_tag * half_turn;
    // TagSLAM has the error in the axes of the pose itself.
    Vector6d sigma = Vector6d::Constant(1e-6);
    if (tag.covariance) {
      const auto own = inverse(Uncertain<SE3>{pose, *tag.covariance}).covariance;
      sigma = own.diagonal().cwiseMax(1e-12).cwiseSqrt();
    }
    text += fmt::format("       - id: {}\n         size: {}\n         pose:\n", id.number,
                        yaml_number(tag.size_m)) +
            xyz("position", pose.translation(), "           ") +
            xyz("rotation", pose.rotation().log(), "           ") +
            xyz("position_noise", sigma.head<3>(), "           ") +
            xyz("rotation_noise", sigma.tail<3>(), "           ");
  }
  return text;
}

std::string transforms_yaml(const MapFile& map) {
  std::string text = "transforms:\n";
  for (const auto& [id, tag] : map.tags.tags) {
    const Eigen::Quaterniond& q = tag.map_T_tag.rotation().quaternion();
    text += fmt::format("  - header:\n      frame_id: map\n    child_frame_id: {}\n    transform:\n",
                        yaml_text(to_string(id)));
    text += xyz("translation", tag.map_T_tag.translation(), "      ") +
            xyz("rotation", Eigen::Vector3d(q.x(), q.y(), q.z()), "      ") +
            fmt::format("        w: {}\n", yaml_number(q.w()));
  }
  return text;
}

}  // namespace

std::vector<std::string> map_form_names() {
  return {"waymark", "academy", "tagslam", "tf", "wpilib", "fmap"};
}

Result<MapForm> map_form(const std::string& name) {
  const std::vector<std::string> names = map_form_names();
  const auto at = std::ranges::find(names, name);
  if (at == names.end())
    return fail(ErrorCode::InvalidArgument, fmt::format("there is no form of maps '{}'", name),
                {.key = "form"}, suggestion(name, names));
  return static_cast<MapForm>(at - names.begin());
}

Result<std::string> to_text(const MapFile& map, MapForm form, std::vector<std::string>& warnings,
                            const std::optional<FieldSize>& field) {
  if (map.tags.tags.empty()) return fail(ErrorCode::InvalidArgument, "the map has no tags");
  if (form == MapForm::Waymark) return to_yaml(map);
  std::set<int> numbers;
  bool certain = true;
  for (const auto& [id, tag] : map.tags.tags) {
    const bool once = numbers.insert(static_cast<int>(id.number)).second;
    if (!once && form != MapForm::Transforms && form != MapForm::Fmap)
      return fail(
          ErrorCode::InvalidArgument,
          fmt::format("two tags of the map have the number {}, and this form knows no families", id.number));
    certain = certain && !tag.covariance;
  }
  if (!certain && form != MapForm::Tagslam)
    warnings.emplace_back("this form cannot say how certain the tags are: left out");
  if (form != MapForm::Tagslam && form != MapForm::Fmap)
    warnings.emplace_back("this form cannot say how large the tags are: left out");
  switch (form) {
    case MapForm::Academy:
      return academy_yaml(map, warnings);
    case MapForm::Tagslam:
      return tagslam_yaml(map);
    case MapForm::Wpilib:
      if (!field)
        warnings.emplace_back(
            "how long and wide the field is, a map does not say: the layout has the box of its tags");
      return to_wpilib_layout(map.tags, field);
    case MapForm::Fmap:
      return to_fmap(map.tags, field);
    default:
      return transforms_yaml(map);
  }
}

}  // namespace waymark
