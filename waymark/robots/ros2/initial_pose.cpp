#include "waymark/robots/ros2/initial_pose.hpp"

#include <cmath>
#include <string>

#include <fmt/format.h>

#include "waymark/geometry/dense.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/ros2/frame_tree.hpp"

namespace waymark {
namespace {

constexpr double kMaxPosition_m = 1e6;
constexpr double kMaxTilt_rad = 0.1;

tl::unexpected<Error> wrong(std::string message, std::string hint = {}) {
  return fail(ErrorCode::InvalidArgument, std::move(message), {.source = kInitialPoseTopic}, std::move(hint));
}

bool plausible(const ros2::Pose& pose) {
  const ros2::Quaternion& q = pose.orientation;
  const double squared = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
  return std::abs(pose.position.x) < kMaxPosition_m && std::abs(pose.position.y) < kMaxPosition_m &&
         std::abs(pose.position.z) < kMaxPosition_m && std::abs(squared - 1) < 0.1;
}

/// The rows and columns for x, y and yaw in the 6 x 6 covariance.
Eigen::Matrix3d planar_covariance(const std::array<double, 36>& six) {
  constexpr std::array<std::size_t, 3> kRow = {0, 1, 5};
  Eigen::Matrix3d P;
  for (Eigen::Index i = 0; i < 3; ++i)
    for (Eigen::Index j = 0; j < 3; ++j)
      P(i, j) = six[6 * kRow[static_cast<std::size_t>(i)] + kRow[static_cast<std::size_t>(j)]];
  return P;
}

/// Whether the matrix is symmetric and its standard deviations are between 1e-6 and 1e3 (m, rad).
bool is_covariance(const Eigen::Matrix3d& P) {
  constexpr double kMinVariance = 1e-12;
  constexpr double kMaxVariance = 1e6;
  if (!P.allFinite() || (P - P.transpose()).norm() > 1e-6 * P.norm()) return false;
  const Eigen::Vector3d variances = symmetric_eigen<3>(P).values;
  return variances.minCoeff() > kMinVariance && variances.maxCoeff() < kMaxVariance;
}

}  // namespace

Result<GivenPose> read_initial_pose(std::span<const std::uint8_t> cdr) {
  const auto message = cdr::decode<ros2::PoseWithCovarianceStamped>(cdr);
  if (!message) return tl::unexpected(message.error());
  const std::string frame = frame_name(message->header.frame_id);
  if (frame != ros2::kMapFrame)
    return wrong(fmt::format("the pose is in frame '{}', expected '{}'", frame, ros2::kMapFrame),
                 fmt::format("Set RViz's fixed frame to {}.", ros2::kMapFrame));
  if (!plausible(message->pose.pose))
    return wrong(fmt::format(
        "the position is not finite or beyond {:g} m, or the orientation is not a unit quaternion",
        kMaxPosition_m));
  const SE3 map_T_base = ros2::from_ros(message->pose.pose);
  const double upright = (map_T_base.rotation() * Eigen::Vector3d::UnitZ()).z();
  if (upright < std::cos(kMaxTilt_rad)) return wrong("the pose of the robot is not upright");
  GivenPose given{project_to_plane(map_T_base), planar_covariance(message->pose.covariance)};
  if (is_covariance(given.covariance)) return given;
  return wrong("the covariance of x, y and yaw is not positive definite",
               "RViz fills it in; otherwise set the variances at indices 0, 7 and 35.");
}

}  // namespace waymark
