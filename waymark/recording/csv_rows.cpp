#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "waymark/geometry/planar.hpp"
#include "waymark/recording/csv_table.hpp"
#include "waymark/recording/csv_text.hpp"

namespace waymark::csv {
namespace {

constexpr double kHalfPixel = 0.5;  // ours less that of TagSLAM's bags, as in ROS

Error words(std::string message) { return {ErrorCode::Unsupported, std::move(message), {}, {}}; }

/// "tag36h11:7", or a number of tag36h11.
std::optional<TagId> tag_of(std::string_view cell) {
  if (const auto number = integer(cell)) {
    if (*number < 0 || *number > 1'000'000) return std::nullopt;
    return TagId{FamilyId::Tag36h11, static_cast<int>(*number)};
  }
  const auto tag = parse_tag_id(cell);
  return tag ? std::optional(*tag) : std::nullopt;
}

}  // namespace

std::optional<double> Rows::value(std::string_view column, const std::vector<std::string_view>& cells) const {
  const auto at = header_.find(column);
  return at ? number(cells[*at]) : std::nullopt;
}

bool Rows::values(std::initializer_list<const char*> columns, const std::vector<std::string_view>& cells) {
  values_.clear();
  for (const char* column : columns) {
    const auto one = value(column, cells);
    if (!one) return false;
    values_.push_back(*one);
  }
  return true;
}

Result<bool> Rows::give(const Sample& sample) {
  if (Status status = visit_(sample); !status) return tl::unexpected(status.error());
  return true;
}

Status Rows::finish() {
  if (!frame_) return {};
  const Sample sample = *std::move(frame_);
  frame_.reset();
  return visit_(sample);
}

Result<bool> Rows::add(std::int64_t time, const std::vector<std::string_view>& cells) {
  const SensorTime stamp{Duration(time)};
  switch (header_.kind()) {
    case Kind::TagCorners:
    case Kind::Detections:
      return on_detection(stamp, cells);
    case Kind::RangeBearing: {
      const auto landmark = integer(cells[*header_.find("landmark")]);
      if (!landmark || !values({"range_m", "bearing_rad"}, cells)) return false;
      return give(RangeBearing{stamp, *landmark, values_[0], values_[1]});
    }
    case Kind::Odometry:
    case Kind::OdometrySpeeds:
    case Kind::OdometryPoses:
      return on_odometry(stamp, cells);
    case Kind::Imu:
      if (!values({"gyro_x_rad_s", "gyro_y_rad_s", "gyro_z_rad_s", "accel_x_m_s2", "accel_y_m_s2",
                   "accel_z_m_s2"},
                  cells))
        return false;
      return give(
          ImuSample{stamp, {values_[0], values_[1], values_[2]}, {values_[3], values_[4], values_[5]}});
    case Kind::Truth:
      return on_truth(stamp, cells);
  }
  return false;
}

Result<bool> Rows::on_detection(SensorTime stamp, const std::vector<std::string_view>& cells) {
  const bool ours = header_.kind() == Kind::Detections;
  const std::string camera(cells[*header_.find(ours ? "camera" : "cam")]);
  const auto tag = tag_of(cells[*header_.find("tag")]);
  const bool corners =
      ours ? values({"tl_x_px", "tl_y_px", "tr_x_px", "tr_y_px", "br_x_px", "br_y_px", "bl_x_px", "bl_y_px"},
                    cells)
           : values({"x3", "y3", "x2", "y2", "x1", "y1", "x0", "y0"}, cells);
  if (!tag || !corners) return false;
  TagDetection detection{.tag = *tag};
  for (std::size_t i = 0; i < 4; ++i) {
    detection.corners_px[i] = {values_[2 * i], values_[2 * i + 1]};
    if (!ours) detection.corners_px[i] += Eigen::Vector2d::Constant(kHalfPixel);
  }
  if (!ours)
    problems_.trap("csv.tag_corners", [] {
      return words(
          "corners are taken as BL, BR, TR, TL with pixel centres at integers, tags without a family as "
          "tag36h11");
    });
  if (const auto at = header_.find("hamming")) {
    const auto hamming = integer(cells[*at]);
    if (!hamming || *hamming < 0 || *hamming > 64) return false;
    detection.hamming = static_cast<int>(*hamming);
  }
  detection.decision_margin = value("decision_margin", cells).value_or(0);

  const bool same_time = frame_ && frame_->stamp == stamp;
  if (!same_time || frame_->camera != camera) {
    if (Status status = finish(); !status) return tl::unexpected(status.error());
    if (!same_time) cameras_now_.clear();
    if (!cameras_now_.insert(camera).second)
      problems_.trap("csv.frame_in_pieces", [] {
        return words("rows of one picture do not follow each other: each run of them is a frame");
      });
    frame_ = TagFrame{.stamp = stamp, .camera = camera.empty() ? "cam" : camera};
  }
  frame_->detections.push_back(detection);
  return true;
}

Result<bool> Rows::on_odometry(SensorTime stamp, const std::vector<std::string_view>& cells) {
  if (header_.kind() == Kind::Odometry) {
    if (!values({"x_m", "y_m", "theta_rad", "speed_m_s", "yaw_rate_rad_s"}, cells)) return false;
    return give(Odometry{stamp, SE2(values_[0], values_[1], values_[2]), values_[3], values_[4]});
  }
  if (header_.kind() == Kind::OdometryPoses) {
    if (!values({"px", "py", "pz", "qx", "qy", "qz", "qw"}, cells)) return false;
    const Eigen::Quaterniond q(values_[6], values_[3], values_[4], values_[5]);
    if (std::abs(q.norm() - 1) > 0.01) return false;
    problems_.trap("csv.flattened", [] {
      return words("poses in space are laid onto the floor: x, y and the heading are kept");
    });
    const SE3 pose(SO3::from_matrix(q.normalized().toRotationMatrix()), {values_[0], values_[1], values_[2]});
    return give(Odometry{.stamp = stamp, .odom_T_base = project_to_plane(pose)});
  }
  if (!values({"v_m_s", "omega_rad_s"}, cells)) return false;
  problems_.trap("csv.integrated", [] {
    return words(
        "the table has speeds but no poses: poses are integrated from 0, each speed over the time before it");
  });
  const double dt = integrated_ ? std::max(0.0, to_seconds(stamp - *integrated_)) : 0;
  const Eigen::Vector3d step(values_[0] * dt, 0, values_[1] * dt);
  odom_T_base_ = odom_T_base_ * SE2::exp(step);
  integrated_ = stamp;
  return give(Odometry{stamp, odom_T_base_, values_[0], values_[1]});
}

Result<bool> Rows::on_truth(SensorTime stamp, const std::vector<std::string_view>& cells) {
  const auto valid = integer(cells[*header_.find("valid")]);
  if (!valid || !values({"x_m", "y_m", "theta_rad"}, cells)) return false;
  if (*valid == 0) {
    problems_.trap("csv.truth_not_valid",
                   [] { return words("rows that say they are not valid are passed over"); });
    return true;
  }
  return give(TruthPose{stamp, lift(SE2(values_[0], values_[1], values_[2]))});
}

}  // namespace waymark::csv
