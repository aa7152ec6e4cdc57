#include "waymark/recording/camera_facts.hpp"

#include <algorithm>

#include "waymark/recording/cdr.hpp"
#include "waymark/recording/ros2_convert.hpp"
#include "waymark/recording/ros2_sound.hpp"
#include "waymark/recording/ros2_tagslam_messages.hpp"

namespace waymark {
namespace {

struct HeaderFirst {
  ros2::Header header{};
  WAYMARK_ROS2_FIELDS(self.header)
};
struct ImageHead {
  ros2::Header header{};
  std::uint32_t height = 0, width = 0;
  std::string encoding{};
  WAYMARK_ROS2_FIELDS(self.header, self.height, self.width, self.encoding)
};
struct OdometryHead {
  ros2::Header header{};
  std::string child_frame_id{};
  WAYMARK_ROS2_FIELDS(self.header, self.child_frame_id)
};

template <class Items>
auto* with_topic(Items& items, std::string_view topic) {
  const auto known = std::ranges::find(items, topic, [](const auto& item) { return item.topic; });
  return known == items.end() ? nullptr : &*known;
}

/// The camera of rectified pictures: the projection matrix, and nothing is bent.
std::optional<CameraModel> rectified_camera(const ros2::CameraInfo& info) {
  if (!(info.p[0] > 0)) return std::nullopt;
  ros2::CameraInfo flat = info;
  flat.distortion_model = "plumb_bob";
  flat.d.clear();
  flat.k = {info.p[0], 0, info.p[2], 0, info.p[5], info.p[6], 0, 0, 1};
  const Result<CameraModel> camera = ros2::from_ros(flat);
  return camera ? std::optional(*camera) : std::nullopt;
}

/// Drivers of cameras that nobody calibrated publish zeros.
Result<CameraModel> camera_of(const ros2::CameraInfo& info) {
  if (!(info.k[0] > 0))
    return fail(ErrorCode::NotFound, "the camera was not calibrated: its focal length is zero", {},
                "Calibrate it (`waymark calibrate camera`), and give the robot's file with --robot.");
  return ros2::from_ros(info);
}

Status add_info(CameraFacts& facts, std::string_view topic, ByteSpan cdr) {
  RecordedCameraInfo* known = with_topic(facts.infos, topic);
  if (known != nullptr && known->camera) return {};
  const auto message = cdr::decode<ros2::CameraInfo>(cdr);
  if (!message) return tl::unexpected(message.error());
  if (known == nullptr) known = &facts.infos.emplace_back();
  known->topic = topic;
  known->frame = frame_name(message->header.frame_id);
  Result<CameraModel> camera = camera_of(*message);
  if (camera) {
    known->camera = std::move(*camera);
    known->rectified = rectified_camera(*message);
    known->error.reset();
  } else {
    known->error = camera.error();
    known->error->place.key = topic;
  }
  return {};
}

Status add_transforms(CameraFacts& facts, ByteSpan cdr) {
  const auto message = cdr::decode<ros2::TFMessage>(cdr);
  if (!message) return tl::unexpected(message.error());
  for (const ros2::TransformStamped& transform : message->transforms) {
    facts.frames.add(transform.header.frame_id, transform.child_frame_id,
                     ros2::sound(transform) ? std::optional(ros2::from_ros(transform)) : std::nullopt);
  }
  return {};
}

Status add_picture(CameraFacts& facts, std::string_view topic, ByteSpan cdr) {
  const auto head = cdr::decode<ImageHead>(cdr);
  if (!head) return tl::unexpected(head.error());
  facts.views.push_back({std::string(topic), frame_name(head->header.frame_id), true, head->encoding});
  return {};
}

Status add_view(CameraFacts& facts, std::string_view topic, bool picture, ByteSpan cdr) {
  const auto head = cdr::decode<HeaderFirst>(cdr);
  if (!head) return tl::unexpected(head.error());
  facts.views.push_back({std::string(topic), frame_name(head->header.frame_id), picture, {}});
  return {};
}

bool is_tags(std::string_view type) {
  return type == ros2::AprilTagDetectionArray::kType || type == ros2::ApriltagArrayStamped::kType ||
         type == ros2::TagPoseArray::kType;
}

}  // namespace

bool first_message_tells(std::string_view type) {
  return is_tags(type) || type == ros2::Image::kType || type == ros2::CompressedImage::kType ||
         type == ros2::Odometry::kType || type == ros2::Imu::kType;
}

Status add_fact(CameraFacts& facts, std::string_view topic, std::string_view type, ByteSpan cdr) {
  if (type == ros2::CameraInfo::kType) return add_info(facts, topic, cdr);
  if (type == ros2::TFMessage::kType) return add_transforms(facts, cdr);
  if (with_topic(facts.views, topic) != nullptr || with_topic(facts.motions, topic) != nullptr) return {};
  if (type == ros2::Image::kType) return add_picture(facts, topic, cdr);
  if (type == ros2::CompressedImage::kType) return add_view(facts, topic, true, cdr);
  if (is_tags(type)) return add_view(facts, topic, false, cdr);
  if (type == ros2::Odometry::kType) {
    const auto head = cdr::decode<OdometryHead>(cdr);
    if (!head) return tl::unexpected(head.error());
    facts.motions.push_back({std::string(topic), frame_name(head->child_frame_id), false});
  }
  if (type == ros2::Imu::kType) {
    const auto head = cdr::decode<HeaderFirst>(cdr);
    if (!head) return tl::unexpected(head.error());
    facts.motions.push_back({std::string(topic), frame_name(head->header.frame_id), true});
  }
  return {};
}

}  // namespace waymark
