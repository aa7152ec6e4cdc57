#include "waymark/drivers/ros2/robot_bridge.hpp"

#include <utility>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"
#include "waymark/codecs/image_codec.hpp"
#include "waymark/recording/cdr.hpp"
#include "waymark/recording/ros2_convert.hpp"
#include "waymark/recording/sample_reader.hpp"

namespace waymark {
namespace {

constexpr std::uint64_t kEachSaid = 8;  // then each time their number has doubled
constexpr std::string_view kTruthTopic = "/truth/pose";

/// What most messages begin with.
struct Headed {
  ros2::Header header{};
  WAYMARK_ROS2_FIELDS(self.header)
};

std::string frame_of(std::span<const std::uint8_t> bytes) {
  const auto message = cdr::decode<Headed>(bytes);
  return message ? frame_name(message->header.frame_id) : std::string();
}

bool worth_saying(std::uint64_t count) { return count <= kEachSaid || (count & (count - 1)) == 0; }

}  // namespace

RobotBridge::RobotBridge(Ros2Profile profile, RobotDescription robot, PutPicture put_picture)
    : profile_(std::move(profile)), robot_(std::move(robot)), put_picture_(std::move(put_picture)) {
  (void)check_.read({.text = to_line(RobotHello{.name = robot_.model.name})});
}

std::vector<std::string> RobotBridge::take_words() {
  std::vector<std::string> lines;
  for (std::string& words : std::exchange(words_, {})) lines.push_back(to_line(RobotLog{std::move(words)}));
  return lines;
}

void RobotBridge::say_once(std::string words) {
  if (said_.try_emplace(words, true).second) words_.push_back(std::move(words));
}

void RobotBridge::drop(const std::string& topic, const Error& error) {
  ++dropped_;
  const std::uint64_t count = ++dropped_of_[topic];
  if (!worth_saying(count)) return;
  words_.push_back(fmt::format("{} message{} of {} {} dropped, the last one: {}", count,
                               count == 1 ? "" : "s", topic, count == 1 ? "was" : "were", error.message));
}

std::vector<std::string> RobotBridge::receive(const Ros2Subscription& from,
                                              std::span<const std::uint8_t> bytes, Duration arrived) {
  const bool needs_clock = from.type != ros2::TFMessage::kType && from.type != ros2::CameraInfo::kType;
  if (needs_clock && !speaks() && from.topic != profile_.odometry_topic) return {};  // whose clock counts
  auto lines = lines_of(from, bytes, arrived);
  if (lines) return std::move(*lines);
  drop(from.topic, lines.error());
  return {};
}

Result<std::vector<std::string>> RobotBridge::lines_of(const Ros2Subscription& from,
                                                       std::span<const std::uint8_t> bytes,
                                                       Duration arrived) {
  std::vector<std::string> lines;
  if (from.type == ros2::TFMessage::kType || from.type == ros2::CameraInfo::kType) {
    Status status = from.type == ros2::TFMessage::kType ? keep_transforms(bytes) : compare_camera(bytes);
    if (!status) return tl::unexpected(status.error());
    return lines;
  }
  if (from.type == ros2::CompressedImage::kType) {
    auto line = compressed_picture(from, bytes, arrived);
    if (!line) return tl::unexpected(line.error());
    lines.push_back(std::move(*line));
    return lines;
  }
  const auto add = [&](const Sample& sample) -> Status {
    Sample turned = sample;
    if (std::holds_alternative<CameraFrame>(sample)) camera_frame_ = frame_of(bytes);
    if (auto* imu = std::get_if<ImuSample>(&turned)) turn_imu(*imu, bytes);
    auto line = line_of(std::move(turned), from, arrived);
    if (!line) return tl::unexpected(line.error());
    lines.push_back(std::move(*line));
    return {};
  };
  SampleDecoder decoder(add);
  const std::string_view topic =
      from.topic == profile_.truth_topic ? kTruthTopic : std::string_view(from.topic);
  Status status = decoder.add(topic, from.type, 0, bytes);
  if (status) status = decoder.finish();
  if (!status) return tl::unexpected(status.error());
  return lines;
}

Result<std::string> RobotBridge::line_of(Sample sample, const Ros2Subscription& from, Duration arrived) {
  const bool leads = from.topic == profile_.odometry_topic;
  if (Status status = gate_.pass(from.topic, stamp_of(sample), arrived, leads); !status)
    return tl::unexpected(status.error());
  if (auto* frame = std::get_if<CameraFrame>(&sample)) {
    frame->camera = "cam";
    const auto picture = encode_pnm(frame->image);
    if (!picture) return tl::unexpected(picture.error());
    return picture_line(frame->stamp, *picture);
  }
  if (auto* tags = std::get_if<TagFrame>(&sample)) tags->camera = "cam";
  std::string line = to_line(sample);
  const auto checked = check_.read({.number = ++checked_, .text = line});
  if (!checked) return tl::unexpected(checked.error());
  return line;
}

/// The picture travels on as it is.
Result<std::string> RobotBridge::compressed_picture(const Ros2Subscription& from,
                                                    std::span<const std::uint8_t> bytes, Duration arrived) {
  const auto message = cdr::decode<ros2::CompressedImage>(bytes);
  if (!message) return tl::unexpected(message.error());
  if (const auto header = probe(message->data, from.topic); !header) return tl::unexpected(header.error());
  const SensorTime stamp = ros2::from_ros(message->header.stamp);
  if (Status status = gate_.pass(from.topic, stamp, arrived, false); !status)
    return tl::unexpected(status.error());
  camera_frame_ = frame_name(message->header.frame_id);
  return picture_line(stamp, message->data);
}

/// A path costs neither base64 nor JSON of the picture's size.
Result<std::string> RobotBridge::picture_line(SensorTime stamp,
                                              const std::vector<std::uint8_t>& picture) const {
  if (!put_picture_) return to_line(CameraFrame{.stamp = stamp}, picture);
  const auto path = put_picture_(picture);
  if (!path) return tl::unexpected(path.error());
  return fmt::format("{{\"type\":\"image\",\"stamp_ns\":{},\"path\":\"{}\"}}\n",
                     stamp.time_since_epoch().count(), *path);
}

void RobotBridge::turn_imu(ImuSample& imu, std::span<const std::uint8_t> bytes) {
  if (frames_.empty()) return;
  const std::string frame = frame_of(bytes);
  auto known = base_R_imu_.find(frame);
  if (known == base_R_imu_.end()) {
    const auto chain = frames_.chain(profile_.base_frame, frame);
    if (!chain) {
      say_once(fmt::format("the IMU's axes are taken as those of the base: {}", chain.error().message));
      return;
    }
    known = base_R_imu_.emplace(frame, chain->rotation()).first;
  }
  imu.angular_velocity_rad_s = known->second * imu.angular_velocity_rad_s;
  imu.linear_acceleration_m_s2 = known->second * imu.linear_acceleration_m_s2;
}

Status RobotBridge::keep_transforms(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kMostFrames = 1000;
  const auto message = cdr::decode<ros2::TFMessage>(bytes);
  if (!message) return tl::unexpected(message.error());
  if (frames_.frames().size() + message->transforms.size() > kMostFrames)
    return fail(ErrorCode::LimitExceeded, fmt::format("there are more than {} frames", kMostFrames));
  for (const ros2::TransformStamped& link : message->transforms) {
    const auto finite = [](double x) { return std::abs(x) < 1e6; };
    const bool sound = finite(link.translation.x) && finite(link.translation.y) &&
                       finite(link.translation.z) && finite(link.rotation.x) && finite(link.rotation.y) &&
                       finite(link.rotation.z) && finite(link.rotation.w);
    frames_.add(link.header.frame_id, link.child_frame_id,
                sound ? std::optional<SE3>(ros2::from_ros(link)) : std::nullopt);
  }
  compare_mounting();
  return {};
}

/// The mounting in tf against that of the robot's file.
void RobotBridge::compare_mounting() {
  constexpr double kFar_m = 0.02;
  constexpr double kTurned_rad = 0.035;
  if (camera_frame_.empty() || !frames_.has(camera_frame_)) return;
  const auto base_T_cam = frames_.chain(profile_.base_frame, camera_frame_);
  if (!base_T_cam) {
    say_once(fmt::format("tf does not say where the camera is mounted: {}", base_T_cam.error().message));
    return;
  }
  const SE3 off = robot_.model.base_T_cam.inverse() * *base_T_cam;
  const double turned = off.rotation().log().norm();
  if (off.translation().norm() > kFar_m || turned > kTurned_rad)
    say_once(fmt::format(
        "tf mounts the camera {:.0f} mm and {:.1f} degrees away from the robot's file {}, which counts",
        1e3 * off.translation().norm(), to_degrees(turned), robot_.model.name));
}

/// The calibration that is published against that of the robot's file.
Status RobotBridge::compare_camera(std::span<const std::uint8_t> bytes) {
  const auto message = cdr::decode<ros2::CameraInfo>(bytes);
  if (!message) return tl::unexpected(message.error());
  const auto camera = ros2::from_ros(*message);
  if (!camera) return tl::unexpected(camera.error());
  if (camera_frame_.empty()) camera_frame_ = frame_name(message->header.frame_id);
  compare_mounting();
  const auto principal = [](const CameraModel& model) {
    return std::visit([](const auto& m) { return Eigen::Vector4d(m.fx, m.fy, m.cx, m.cy); },
                      model.projection());
  };
  const bool sized =
      camera->width_px() == robot_.camera.width_px() && camera->height_px() == robot_.camera.height_px();
  const Eigen::Vector4d theirs = principal(*camera);
  const Eigen::Vector4d ours = principal(robot_.camera);
  constexpr double kShare = 0.01;
  if (sized && (theirs - ours).cwiseAbs().maxCoeff() <= kShare * ours[0]) return {};
  say_once(fmt::format(
      "camera_info says {} x {} px with f {:.1f} px, c ({:.1f}, {:.1f}) px; the robot's file {} says {} x {} "
      "px, {:.1f}, ({:.1f}, {:.1f}), which counts",
      camera->width_px(), camera->height_px(), theirs[0], theirs[2], theirs[3], robot_.model.name,
      robot_.camera.width_px(), robot_.camera.height_px(), ours[0], ours[2], ours[3]));
  return {};
}

std::vector<std::uint8_t> RobotBridge::command(const VelocityCommand& command, SensorTime now) const {
  const ros2::TwistStamped stamped = ros2::to_ros(StampedCommand{now, command});
  return profile_.command_stamped ? cdr::encode(stamped) : cdr::encode(stamped.twist);
}

}  // namespace waymark
