// Writes one recording with every supported message type, for the validators. usage: waymark_all_types
// FILE.mcap
#include <cstdio>

#include "waymark/codecs/image_codec.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace {

using namespace waymark;

SensorTime at_ms(std::int64_t ms) { return SensorTime(std::chrono::milliseconds(1000 + ms)); }

CameraModel camera() {
  return *CameraModel::make(PinholeRadtan{.fx = 440, .fy = 440, .cx = 320, .cy = 240}, 640, 480);
}

TagFrame tags() {
  TagDetection tag{.tag = {FamilyId::Tag36h11, 7}};
  tag.corners_px = {Eigen::Vector2d(10, 20), Eigen::Vector2d(30, 20), Eigen::Vector2d(30, 40),
                    Eigen::Vector2d(10, 40)};
  tag.corner_covariance_px2 = CornerCovariance::Identity() * 0.01;
  TagDetection unreliable = tag;
  unreliable.tag.number = 8;
  unreliable.corner_state = CornerState::Unreliable;
  return {.stamp = at_ms(20), .detections = {tag, unreliable}};
}

Status add_samples(SampleRecorder& recorder) {
  const std::vector<Sample> samples = {
      CameraFrame{at_ms(10), "cam", Image(640, 480, 77)},
      tags(),
      TagPoseFrame{at_ms(30), "cam", {{{FamilyId::Tag36h11, 11}, SE3({}, {0, 0, 1})}}},
      RangeBearing{at_ms(40), 17, 3.25, -0.5},
      LaserScan{at_ms(50), -3.1, 0.1, 0.001, 0.1, 12, {1.0F, 2.5F, 3.0F}},
      GamepadState{at_ms(60), {-1.0F, 0.25F}, {0, 1}},
      Odometry{at_ms(70), SE2(1, -2, 0.5), 0.3, -0.1},
      WheelTicks{at_ms(80), 1.5, 2.5},
      ImuSample{at_ms(90), {0.1, 0.2, 0.3}, {0, 0, 9.8}},
      StampedCommand{at_ms(100), {0.25, -0.5}},
      TruthPose{at_ms(110), SE3()},
  };
  for (const Sample& sample : samples)
    if (Status status = recorder.add(sample); !status) return status;
  return {};
}

Status add_messages(SampleRecorder& recorder) {
  const ros2::Header header{ros2::to_ros(at_ms(120)), "map"};
  ros2::Marker marker{
      .header = header, .ns = "tags", .id = 3, .type = ros2::Marker::kText, .text = "tag36h11:3"};
  marker.points = {{1, 2, 3}};
  marker.colors = {{1, 0, 0, 1}};
  marker.uv_coordinates = {{0.5F, 0.25F}};
  marker.mesh_file.filename = "none.stl";
  const auto png = encode_png(Image(8, 8, 9));
  if (!png) return tl::unexpected(png.error());
  Status status = recorder.add_message("/markers", at_ms(120), ros2::MarkerArray{{marker, marker}});
  if (status)
    status = recorder.add_message("/plan", at_ms(130), ros2::Path{header, {{header, {}}, {header, {}}}});
  if (status)
    status =
        recorder.add_message("/diagnostics", at_ms(140),
                             ros2::DiagnosticArray{header, {{1, "camera", "slow", "usb", {{"rate", "9"}}}}});
  if (status)
    status =
        recorder.add_message("/image_raw/compressed", at_ms(150), ros2::CompressedImage{header, "png", *png});
  if (status) status = recorder.add_message("/cmd_vel_unstamped", at_ms(160), ros2::Twist{{0.1, 0, 0}, {}});
  if (status)
    status = recorder.add_message("/waymark/pose", at_ms(170), ros2::PoseWithCovarianceStamped{header, {}});
  return status;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  auto file = create_file(argv[1]);
  if (!file) return 1;
  auto recorder = SampleRecorder::open(std::move(*file));
  Status status = recorder->add_camera(at_ms(0), camera(), SE3());
  if (status) status = recorder->add_metadata("waymark", {{"seed", "1"}});
  if (status) status = recorder->add_attachment("map.yaml", "application/yaml", at_ms(0), "tags: {}\n");
  if (status) status = add_samples(*recorder);
  if (status) status = add_messages(*recorder);
  if (status) status = recorder->close();
  if (!status) std::fprintf(stderr, "%s\n", to_string(status.error()).c_str());
  return status ? 0 : 1;
}
