#include "waymark/app/common/estimate_message.hpp"

#include <string>

#include <fmt/format.h>

#include "waymark/geometry/planar.hpp"
#include "waymark/recording/ros2/convert.hpp"

namespace waymark {

ros2::PoseWithCovarianceStamped estimate_message(const LocalizationEstimate& estimate) {
  ros2::PoseWithCovarianceStamped message;
  message.header = {.stamp = ros2::to_ros(estimate.stamp), .frame_id = std::string(ros2::kMapFrame)};
  message.pose.pose = ros2::to_ros(lift(estimate.map_T_base));
  constexpr std::size_t kRow[3] = {0, 1, 5};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      message.pose.covariance[6 * kRow[i] + kRow[j]] =
          estimate.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }
  return message;
}

ros2::DiagnosticArray nis_message(const NisRecord& record) {
  ros2::DiagnosticArray message;
  message.header = {.stamp = ros2::to_ros(record.stamp), .frame_id = std::string(ros2::kMapFrame)};
  message.status.push_back({.level = static_cast<std::uint8_t>(record.accepted ? 0 : 1),
                            .name = to_string(record.tag),
                            .message = record.accepted ? "accepted" : "rejected",
                            .hardware_id = {},
                            .values = {{"nis", fmt::format("{:.4f}", record.nis)},
                                       {"degrees_of_freedom", std::to_string(record.rows)}}});
  return message;
}

}  // namespace waymark
