#include "waymark/robots/process/read_tags.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace waymark {
namespace {

using nlohmann::json;

constexpr double kFarthest_m = 1e6;

TagId id_of(MessageFields& fields, const json& tag) {
  const bool named = tag.is_object() && tag.contains("tag") && tag["tag"].is_string();
  const auto id = parse_tag_id(named ? tag["tag"].get<std::string>() : std::string());
  if (id) return *id;
  fields.wrong("tags", "a tag has no name such as \"tag36h11:7\" under the key 'tag'");
  return {};
}

/// Empty where there are not `count` numbers.
std::vector<double> entries(const json& object, const char* key, std::size_t count) {
  const auto list = object.is_object() ? object.find(key) : object.end();
  std::vector<double> numbers;
  if (!object.is_object() || list == object.end() || !list->is_array() || list->size() != count) return {};
  for (const json& number : *list)
    if (number.is_number()) numbers.push_back(number.get<double>());
  return numbers.size() == count ? numbers : std::vector<double>();
}

}  // namespace

TagDetection detection_of(MessageFields& fields, const json& tag) {
  TagDetection detection;
  const json none;
  const auto at = [&](const char* key) -> const json& {
    const auto found = tag.is_object() ? tag.find(key) : tag.end();
    return tag.is_object() && found != tag.end() ? *found : none;
  };
  detection.tag = id_of(fields, tag);
  const json& corners = at("corners_px");
  const auto is_point = [](const json& point) {
    return point.is_array() && point.size() == 2 && point[0].is_number() && point[1].is_number() &&
           std::abs(point[0].get<double>()) < 1e5 && std::abs(point[1].get<double>()) < 1e5;
  };
  if (!corners.is_array() || corners.size() != 4 || !std::ranges::all_of(corners, is_point)) {
    fields.wrong("tags", "'corners_px' is not four points [x, y]",
                 "Top left, top right, bottom right, bottom left of the printed tag.");
    return detection;
  }
  for (std::size_t i = 0; i < 4; ++i)
    detection.corners_px[i] = {corners[i][0].get<double>(), corners[i][1].get<double>()};
  if (at("hamming").is_number_integer()) detection.hamming = at("hamming").get<int>();
  if (at("decision_margin").is_number()) detection.decision_margin = at("decision_margin").get<double>();
  if (const json& sigma = at("corner_sigma_px"); sigma.is_number() && sigma.get<double>() > 0)
    detection.corner_covariance_px2 =
        CornerCovariance::Identity() * sigma.get<double>() * sigma.get<double>();
  return detection;
}

SeenTagPose tag_pose_of(MessageFields& fields, const json& tag) {
  const TagId id = id_of(fields, tag);
  const std::vector<double> at = entries(tag, "position_m", 3);
  const std::vector<double> q = entries(tag, "rotation_xyzw", 4);
  const bool near =
      !at.empty() && std::ranges::all_of(at, [](double x) { return std::abs(x) < kFarthest_m; });
  if (!near) fields.wrong("tags", "'position_m' is not three numbers");
  Result<SO3> rotation = fail(ErrorCode::Unreadable, "'rotation_xyzw' is not four numbers");
  if (!q.empty()) rotation = SO3::try_from_quaternion(Eigen::Quaterniond(q[3], q[0], q[1], q[2]));
  if (!rotation) fields.wrong("tags", rotation.error().message);
  return near && rotation ? SeenTagPose{id, SE3(*rotation, Eigen::Vector3d(at[0], at[1], at[2]))}
                          : SeenTagPose{id, {}};
}

}  // namespace waymark
