#include "waymark/recording/ros2_tagslam_messages.hpp"

#include "waymark/recording/ros2_convert.hpp"

namespace waymark::ros2 {
namespace {

constexpr double kHalfPixel = 0.5;  // ours less theirs

Result<FamilyId> family_of(const std::string& name) {
  if (name.empty() || name == "mit" || name == "tf36h11") return FamilyId::Tag36h11;
  return parse_family(name);
}

}  // namespace

Result<TagFrame> from_ros(const ApriltagArrayStamped& message) {
  TagFrame frame{.stamp = from_ros(message.header.stamp), .camera = camera_of_frame(message.header.frame_id)};
  for (const Apriltag& in : message.apriltags) {
    const Result<FamilyId> family = family_of(in.family);
    if (!family) return tl::unexpected(family.error());
    TagDetection detection{.tag = {*family, in.id}, .hamming = in.hamming};
    for (std::size_t i = 0; i < 4; ++i)
      detection.corners_px[3 - i] = {in.corners[i].x + kHalfPixel, in.corners[i].y + kHalfPixel};
    frame.detections.push_back(detection);
  }
  return frame;
}

}  // namespace waymark::ros2
