#include "waymark/app/localize/camera_moment.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "waymark/factors/rolling_shutter.hpp"
#include "waymark/geometry/dense.hpp"
#include "waymark/pose/multi_tag_pose.hpp"
#include "waymark/pose/square_pose.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/samples/mounted_camera.hpp"

namespace waymark {
namespace {

constexpr int kMinRedundancy = 20;   // number of residuals minus number of unknowns
constexpr double kMaxError_px = 10;  // corners with larger errors are not used for poses
constexpr double kTolerance_px = 1e-4;

using Vector8 = Eigen::Matrix<double, 8, 1>;

CornerCovariance covariance_of(const TagDetection& detection) {
  const double default_px = MultiTagOptions{}.corner_sigma_px;
  return detection.corner_covariance_px2.value_or(default_px * default_px * CornerCovariance::Identity());
}

/// Corner residuals of a tag, along the principal axes of their covariance.
struct Residuals {
  Vector8 squares_px2;
  Vector8 variances_px2;

  [[nodiscard]] double chi2(double sigma_px) const {
    return (squares_px2.array() / (variances_px2.array() + sigma_px * sigma_px)).sum();
  }
};

std::optional<Residuals> residuals_of(const TagDetection& detection, const SE3& cam_T_map, const TagMap& map,
                                      const CameraModel& camera) {
  const MappedTag* tag = map.find(detection.tag);
  if (tag == nullptr) return std::nullopt;
  const auto corners = square_corners(tag->size_m);
  Vector8 residuals_px;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto px = camera.project(cam_T_map * (tag->map_T_tag * corners[k]));
    if (!px) return std::nullopt;
    residuals_px.segment<2>(static_cast<Eigen::Index>(2 * k)) = detection.corners_px[k] - *px;
  }
  const SymmetricEigen<8> axes = symmetric_eigen<8>(covariance_of(detection));
  if (!axes.converged) return std::nullopt;
  return Residuals{(axes.vectors.transpose() * residuals_px).cwiseAbs2(), axes.values.cwiseMax(0)};
}

}  // namespace

double common_corner_error_px(const std::vector<PosedTags>& images, const TagMap& map,
                              const CameraModel& camera) {
  std::vector<Residuals> all;
  double redundancy = 0;
  for (const PosedTags& image : images) {
    const std::size_t before = all.size();
    for (const TagDetection& detection : image.detections)
      if (const auto one = residuals_of(detection, image.cam_T_map, map, camera)) all.push_back(*one);
    if (all.size() > before) redundancy += 8.0 * static_cast<double>(all.size() - before) - 6;
  }
  if (redundancy < kMinRedundancy) return 0;
  const auto too_large = [&](double sigma_px) {
    double chi2 = 0;
    for (const Residuals& one : all) chi2 += one.chi2(sigma_px);
    return !(chi2 <= redundancy);  // also true for NaN, which results from a singular covariance
  };
  if (!too_large(0)) return 0;
  double low = 0, high = kMaxError_px;
  while (high - low > kTolerance_px) (too_large((low + high) / 2) ? low : high) = (low + high) / 2;
  return high;
}

TagFrame with_corner_error(TagFrame frame, double sigma_px) {
  for (TagDetection& detection : frame.detections)
    detection.corner_covariance_px2 =
        covariance_of(detection) + sigma_px * sigma_px * CornerCovariance::Identity();
  return frame;
}

namespace {

// Maximum time between an image and those used to compute its motion.
constexpr auto kMaxGap = std::chrono::milliseconds(250);
// Large, because a pose found in a late iteration can still help its neighbours.
constexpr int kMaxIterations = 8;
constexpr std::size_t kLiveImages = 100;  // number of live images used to estimate the corner error
constexpr int kImagesPerUpdate = 5;
constexpr double kInitialError_px = 1;  // large enough that no image is rejected before the motion is known
constexpr double kConvergedChange = 0.02;  // relative change of the corner error at convergence

SE3 map_T_optical(const CameraMoment& moment) {
  return moment.map_T_body->mean * SE3(body_R_optical(), Eigen::Vector3d::Zero());
}

struct CameraMotion {
  SE3 cam_T_map{};
  Vector6 twist{};  ///< rate of change of cam_T_map, as a left tangent per second
};

/// The nearest moment with a pose in the direction of `step`. If there is none, moment i, or null if it has
/// no pose either.
const CameraMoment* neighbour(const std::vector<CameraMoment>& moments, std::size_t i, int step) {
  const CameraMoment& here = moments[i];
  const auto end = static_cast<std::ptrdiff_t>(moments.size());
  for (auto k = static_cast<std::ptrdiff_t>(i) + step; k >= 0 && k < end; k += step) {
    const CameraMoment& moment = moments[static_cast<std::size_t>(k)];
    if (moment.stamp < here.stamp - kMaxGap || moment.stamp > here.stamp + kMaxGap) break;
    if (moment.map_T_body) return &moment;
  }
  return here.map_T_body ? &here : nullptr;
}

/// The motion at moment i, computed from the poses before and after it. Moment i itself need not have a pose.
std::optional<CameraMotion> motion_at(const std::vector<CameraMoment>& moments, std::size_t i) {
  const CameraMoment* before = neighbour(moments, i, -1);
  const CameraMoment* after = neighbour(moments, i, +1);
  if (before == nullptr || after == nullptr || !(before->stamp < after->stamp)) return std::nullopt;
  const SE3 before_T_map = map_T_optical(*before).inverse();
  const SE3 after_T_before = map_T_optical(*after).inverse() * before_T_map.inverse();
  const Vector6 twist = after_T_before.log() / to_seconds(after->stamp - before->stamp);
  if (moments[i].map_T_body) return CameraMotion{map_T_optical(moments[i]).inverse(), twist};
  const double since_s = to_seconds(moments[i].stamp - before->stamp);
  return CameraMotion{SE3::exp(since_s * twist) * before_T_map, twist};
}

/// Moves the corners to where they were when the middle row was read.
TagFrame at_middle_row(const CameraMotion& motion, const TagMap& map, const CameraModel& camera,
                       double readout_s, TagFrame frame) {
  for (TagDetection& detection : frame.detections) {
    const MappedTag* tag = map.find(detection.tag);
    if (tag == nullptr) continue;
    const MovingTag moving{
        .cam_T_tag = motion.cam_T_map * tag->map_T_tag, .twist = motion.twist, .size_m = tag->size_m};
    const auto shift = rolling_shift(moving, detection.corners_px, camera, readout_s);
    if (!shift) continue;
    for (std::size_t k = 0; k < 4; ++k)
      detection.corners_px[k] -= shift->segment<2>(static_cast<Eigen::Index>(2 * k));
  }
  return frame;
}

/// The tags in an image that were used for its pose. The moment must have a pose.
PosedTags posed(const TagFrame& frame, const CameraMoment& moment) {
  PosedTags image{.cam_T_map = map_T_optical(moment).inverse()};
  for (const std::size_t k : moment.used) image.detections.push_back(frame.detections[k]);
  return image;
}

std::vector<PosedTags> posed(const std::vector<TagFrame>& frames, const std::vector<CameraMoment>& moments) {
  std::vector<PosedTags> images;
  for (std::size_t i = 0; i < frames.size(); ++i)
    if (moments[i].map_T_body) images.push_back(posed(frames[i], moments[i]));
  return images;
}

}  // namespace

CameraMoment camera_moment(const TagFrame& frame, const TagMap& map, const CameraModel& camera) {
  CameraMoment moment{.stamp = frame.stamp, .tags = static_cast<int>(frame.detections.size())};
  const auto pose = estimate_camera_pose(frame.detections, map, camera);
  if (!pose || !pose->usable()) {
    const auto in_map = [&](const TagDetection& seen) { return map.find(seen.tag) != nullptr; };
    const auto usable = [&](const TagDetection& seen) { return in_map(seen) && usable_corners(seen); };
    const bool known = std::ranges::any_of(frame.detections, in_map);
    if (!frame.detections.empty())
      moment.why = !known                                           ? "none of the tags is in the map"
                   : std::ranges::none_of(frame.detections, usable) ? "the corners of the tags are unreliable"
                   : pose && pose->ambiguous() ? "the pose is ambiguous, or the tags are inconsistent"
                                               : "no pose fits the tags";
    return moment;
  }
  const CameraPoseEstimate& best = pose->estimates.front();
  moment.used = best.detections;
  moment.tags = static_cast<int>(moment.used.size());
  // Multiplying a rotation on the right does not change the covariance of a left perturbation.
  const SE3 cam_T_body(body_R_optical().inverse(), Eigen::Vector3d::Zero());
  moment.map_T_body = Uncertain<SE3>{best.map_T_cam * cam_T_body, best.covariance};
  return moment;
}

CameraMoment LiveMoments::of(const TagFrame& frame) {
  CameraMoment moment = camera_moment(with_corner_error(frame, corner_error_px_), *map_, *camera_);
  if (!moment.map_T_body) return moment;
  last_.push_back(posed(frame, moment));
  if (last_.size() > kLiveImages) last_.pop_front();
  if (++since_ >= kImagesPerUpdate) {
    since_ = 0;
    corner_error_px_ = common_corner_error_px({last_.begin(), last_.end()}, *map_, *camera_);
  }
  return moment;
}

CameraMoments camera_moments(const std::vector<TagFrame>& frames, const TagMap& map,
                             const CameraModel& camera, double readout_s) {
  CameraMoments all{.corner_error_px = kInitialError_px};
  std::vector<TagFrame> corrected = frames;  // the frames as a global shutter would have captured them
  for (int k = 0; k < kMaxIterations; ++k) {
    const std::vector<CameraMoment> before = std::move(all.moments);
    all.moments.clear();
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const auto motion = k > 0 && readout_s != 0 ? motion_at(before, i) : std::nullopt;
      if (motion) corrected[i] = at_middle_row(*motion, map, camera, readout_s, frames[i]);
      all.moments.push_back(camera_moment(with_corner_error(corrected[i], all.corner_error_px), map, camera));
    }
    const double error_px = common_corner_error_px(posed(corrected, all.moments), map, camera);
    const bool converged = std::abs(error_px - all.corner_error_px) < kConvergedChange * error_px;
    all.corner_error_px = error_px;
    if (converged && readout_s == 0) break;
  }
  return all;
}

ros2::PoseWithCovarianceStamped pose_message(const CameraMoment& moment) {
  ros2::PoseWithCovarianceStamped message;
  message.header = {.stamp = ros2::to_ros(moment.stamp), .frame_id = std::string(ros2::kMapFrame)};
  message.pose.pose = ros2::to_ros(moment.map_T_body->mean);
  const SE3::Jacobian covariance = coordinate_covariance(*moment.map_T_body);
  for (Eigen::Index i = 0; i < 6; ++i)
    for (Eigen::Index j = 0; j < 6; ++j)
      message.pose.covariance[static_cast<std::size_t>(6 * i + j)] = covariance(i, j);
  return message;
}

Result<DescribedCamera> read_given_camera(const CameraDescription& camera) {
  if (camera.file.empty())
    return fail(ErrorCode::InvalidArgument, "no camera calibration is given", {.key = "camera"},
                "Set `camera` to a calibration file; `waymark calibrate camera` writes one.");
  return read_camera(camera);
}

Status check_tag_poses(const TagMap& map, const std::string& source) {
  if (!map.tags.empty()) return {};
  return fail(ErrorCode::InvalidArgument,
              "a camera needs a map with tag poses, but this one contains only points", {.source = source},
              "Use a map written by `waymark map`.");
}

Result<TagFinder> tag_finder_for(const TagMap& map) {
  return make_tag_finder({.families = families_of(map)});
}

}  // namespace waymark
