#include "waymark/recording/recording_setup.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/samples/mounted_camera.hpp"

namespace waymark {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const SE3 kUp(SO3(), {0.084, 0, 0.18});
const SE3 kTurned(SO3::from_rpy(0.1, -0.2, 0.3), {0.01, 0.02, 0.03});
const SE3 kOpticalTurn(body_R_optical(), Eigen::Vector3d::Zero());

CameraModel some_camera(double focal_px = 400) {
  return *CameraModel::make(PinholeRadtan{.fx = focal_px, .fy = focal_px, .cx = 320, .cy = 240}, 640, 480);
}

/// A robot with a chain of three transforms, named as by a RealSense driver.
CameraFacts a_robot() {
  CameraFacts facts;
  facts.frames.add("odom", "base_link", SE3());
  facts.frames.add("base_link", "camera_link", kUp);
  facts.frames.add("camera_link", "camera_color_frame", kTurned);
  facts.frames.add("/camera_color_frame", "/camera_color_optical_frame", kOpticalTurn);
  facts.infos.push_back({"/camera/color/camera_info", "camera_color_optical_frame", some_camera()});
  facts.views.push_back({"/camera/color/image_raw", "camera_color_optical_frame", true, "rgb8"});
  facts.motions.push_back({"/odom", "base_link", false});
  return facts;
}

std::string mounting_error(const CameraFacts& facts, const CameraChoice& choice = {}) {
  const ChosenCamera chosen = choose_camera(facts, choice);
  EXPECT_FALSE(chosen.base_T_cam);
  return chosen.mounting_error ? to_string(*chosen.mounting_error) : "";
}

void expect_same(const SE3& a, const SE3& b) { EXPECT_LT((a.inverse() * b).log().norm(), 1e-12); }

TEST(CameraChoice, ComposesAllTransformsOfTheChain) {
  const ChosenCamera chosen = choose_camera(a_robot(), {});
  ASSERT_TRUE(chosen.base_T_cam);
  expect_same(*chosen.base_T_cam, kUp * kTurned * kOpticalTurn);
  EXPECT_EQ(chosen.base_frame, "base_link");
  EXPECT_EQ(chosen.camera_frame, "camera_color_optical_frame");
  EXPECT_TRUE(chosen.camera);
  EXPECT_FALSE(chosen.ambiguous);
  EXPECT_THAT(chosen.unused, IsEmpty());
}

TEST(CameraChoice, ACalibrationOfAnotherImageSizeIsRejected) {
  CameraFacts facts = a_robot();
  facts.views[0].width_px = 640;
  facts.views[0].height_px = 480;
  EXPECT_TRUE(choose_camera(facts, {}).camera);
  facts.views[0].width_px = 1280;
  facts.views[0].height_px = 960;
  const ChosenCamera chosen = choose_camera(facts, {});
  EXPECT_FALSE(chosen.camera);
  ASSERT_TRUE(chosen.camera_error);
  EXPECT_THAT(chosen.camera_error->message, HasSubstr("640x480"));
  EXPECT_THAT(chosen.camera_error->message, HasSubstr("1280x960"));
  facts.views.push_back({"/detections", "camera_color_optical_frame", false, {}});
  EXPECT_TRUE(choose_camera(facts, {}).camera) << "images are not used if there are tags";
}

TEST(CameraChoice, DetectionsMayBeOfRectifiedImages) {
  CameraFacts facts = a_robot();
  facts.infos[0].rectified = some_camera(420);
  EXPECT_FALSE(choose_camera(facts, {}).rectified) << "the topic of the images is known";
  facts.views = {{"/detections", "camera_color_optical_frame", false, {}}};
  EXPECT_EQ(choose_camera(facts, {}).rectified, facts.infos[0].rectified);
  const auto flat = PinholeRadtan{.fx = 420, .fy = 420, .cx = 320, .cy = 240, .coefficients = 5};
  facts.infos[0].camera = CameraModel::make(flat, 640, 480).value();
  auto same = flat;
  same.coefficients = 0;
  facts.infos[0].rectified = CameraModel::make(same, 640, 480).value();
  EXPECT_FALSE(choose_camera(facts, {}).rectified) << "both have the same pixels";
}

TEST(CameraFacts, AMismatchWithTheImagesNamesThePartThatIsSent) {
  ros2::CameraInfo info = ros2::to_ros(some_camera(), SensorTime{}, "cam");
  info.binning_x = info.binning_y = 2;
  ros2::Image image;
  image.header = info.header;
  image.width = 640;
  image.height = 480;
  image.encoding = "mono8";
  CameraFacts facts;
  ASSERT_TRUE(add_fact(facts, "/cam/camera_info", ros2::CameraInfo::kType, cdr::encode(info)));
  ASSERT_TRUE(add_fact(facts, "/cam/image_raw", ros2::Image::kType, cdr::encode(image)));
  const ChosenCamera chosen = choose_camera(facts, {});
  ASSERT_TRUE(chosen.camera_error);
  for (const char* part : {"640x480, binning 2x2", "320x240"})
    EXPECT_THAT(chosen.camera_error->message, HasSubstr(part));
}

TEST(CameraFacts, AnUnsupportedEncodingIsKnownFromTheFirstImage) {
  ros2::Image image;
  image.width = image.height = 8;
  image.encoding = "bayer_rggb4";
  CameraFacts facts;
  ASSERT_TRUE(add_fact(facts, "/camera/image_raw", ros2::Image::kType, cdr::encode(image)));
  ASSERT_EQ(facts.views.size(), 1U);
  ASSERT_TRUE(facts.views[0].error);
  EXPECT_EQ(facts.views[0].error->place.key, "/camera/image_raw");
  EXPECT_THAT(facts.views[0].error->message, HasSubstr("bayer_rggb4"));
  image.encoding = "nv12";
  ASSERT_TRUE(add_fact(facts, "/other/image_raw", ros2::Image::kType, cdr::encode(image)));
  EXPECT_FALSE(facts.views[1].error);
}

TEST(CameraChoice, TheBaseIsTheChildFrameOfTheOdometry) {
  CameraFacts facts = a_robot();
  facts.frames.add("base_footprint", "base_link", SE3(SO3(), {0, 0, 0.01}));  // a second parent, besides odom
  EXPECT_TRUE(choose_camera(facts, {}).base_T_cam);
  facts.motions = {{"/odom", "base_footprint", false}};
  EXPECT_THAT(mounting_error(facts), HasSubstr("base_footprint"));
  CameraFacts above;
  above.frames.add("base_footprint", "base_link", SE3(SO3(), {0, 0, 0.01}));
  above.frames.add("base_link", "cam_optical", kUp * kOpticalTurn);
  above.views.push_back({"/detections", "cam_optical", false, {}});
  above.motions = {{"/odom", "base_footprint", false}};
  expect_same(*choose_camera(above, {}).base_T_cam, SE3(SO3(), {0.084, 0, 0.19}) * kOpticalTurn);
  above.motions.clear();
  expect_same(*choose_camera(above, {}).base_T_cam, kUp * kOpticalTurn);
  expect_same(*choose_camera(above, {.base_frame = "base_footprint"}).base_T_cam,
              SE3(SO3(), {0.084, 0, 0.19}) * kOpticalTurn);
}

TEST(CameraChoice, AnUnusableChainShowsTheTree) {
  CameraFacts missing = a_robot();
  missing.views[0].frame = "default_cam";
  const std::string words = mounting_error(missing);
  EXPECT_THAT(words, HasSubstr("'default_cam'"));
  testing::expect_on_page("recording", words);
  EXPECT_THAT(words, HasSubstr("\n      camera_link\n        camera_color_frame"));
  EXPECT_THAT(words, HasSubstr("`camera_frame`"));
  EXPECT_TRUE(choose_camera(missing, {.camera_frame = "camera_color_optical_frame"}).base_T_cam);

  CameraFacts moving = a_robot();
  moving.frames.add("base_link", "camera_link", SE3(SO3(), {0.09, 0, 0.18}));
  EXPECT_THAT(mounting_error(moving), HasSubstr("camera_link"));
  testing::expect_on_page("recording", mounting_error(moving));

  CameraFacts apart = a_robot();
  apart.motions[0].frame = "chassis";
  apart.frames.add("world", "chassis", SE3());
  EXPECT_THAT(mounting_error(apart), HasSubstr("'chassis'"));
  testing::expect_on_page("recording", mounting_error(apart));

  CameraFacts circle;
  circle.frames.add("a_optical", "b", SE3());
  circle.frames.add("b", "a_optical", SE3());
  circle.frames.add("b", "base_link", SE3());
  circle.views.push_back({"/detections", "a_optical", false, {}});
  EXPECT_THAT(mounting_error(circle), HasSubstr("a_optical -> b -> a_optical"));
  testing::expect_on_page("recording", mounting_error(circle));

  CameraFacts broken;
  broken.frames.add("base_link", "a_optical", std::nullopt);
  broken.views.push_back({"/detections", "a_optical", false, {}});
  EXPECT_THAT(mounting_error(broken), ::testing::Not(IsEmpty()));
  testing::expect_on_page("recording", mounting_error(broken));
}

TEST(CameraChoice, RejectsABodyFrameAsOpticalFrame) {
  CameraFacts facts = a_robot();
  facts.views[0].frame = "camera_link";
  facts.infos[0].frame = "camera_link";
  EXPECT_THAT(mounting_error(facts), HasSubstr("camera_link"));
  testing::expect_on_page("recording", mounting_error(facts));
  EXPECT_TRUE(choose_camera(facts, {.camera_frame = "camera_link"}).base_T_cam);
}

TEST(CameraChoice, OneOfSeveralCamerasMustBeChosen) {
  CameraFacts facts = a_robot();
  facts.views.push_back({"/camera/infra1/image_rect_raw", "camera_infra1_optical_frame", true, "mono8"});
  facts.views.push_back({"/camera/depth/image_rect_raw", "camera_depth_optical_frame", true, "16UC1"});
  facts.infos.push_back({"/camera/infra1/camera_info", "camera_infra1_optical_frame", some_camera(500)});
  facts.frames.add("camera_link", "camera_infra1_optical_frame", kOpticalTurn);
  const ChosenCamera open = choose_camera(facts, {});
  ASSERT_TRUE(open.ambiguous);
  EXPECT_THAT(to_string(*open.ambiguous), HasSubstr("2 cameras"));
  const CameraModel expected = some_camera(500);
  for (const CameraChoice& choice : {CameraChoice{.camera_frame = "camera_infra1_optical_frame"},
                                     CameraChoice{.camera_topic = "/camera/infra1"}}) {
    const ChosenCamera chosen = choose_camera(facts, choice);
    EXPECT_FALSE(chosen.ambiguous);
    EXPECT_EQ(chosen.camera, expected);
    EXPECT_THAT(chosen.unused, Contains("/camera/color/image_raw"));
    EXPECT_THAT(chosen.unused, Contains("/camera/depth/image_rect_raw"));
    expect_same(*chosen.base_T_cam, kUp * kOpticalTurn);
  }
}

TEST(CameraChoice, SixteenBitImagesAreDepthImagesOnlyIfTheirTopicIndicatesIt) {
  CameraFacts facts = a_robot();
  facts.views[0].encoding = "16UC1";
  EXPECT_THAT(choose_camera(facts, {}).unused, IsEmpty());
  facts.views[0].topic = "/camera/depth/image_rect_raw";
  EXPECT_THAT(choose_camera(facts, {}).unused, Contains("/camera/depth/image_rect_raw"));
}

TEST(CameraChoice, EachImageIsReadOnce) {
  CameraFacts facts = a_robot();
  facts.views.push_back({"/camera/color/image_raw/compressed", "camera_color_optical_frame", true, {}});
  facts.views.push_back({"/camera/color/image_rect", "camera_color_optical_frame", true, {}});
  const ChosenCamera chosen = choose_camera(facts, {});
  EXPECT_THAT(chosen.unused, ::testing::UnorderedElementsAre("/camera/color/image_raw/compressed",
                                                             "/camera/color/image_rect"));
  EXPECT_FALSE(chosen.notes.empty());
}

TEST(CameraChoice, RectifiedImagesUseTheProjectionMatrix) {
  CameraFacts facts = a_robot();
  facts.infos[0].rectified = some_camera(380);
  facts.views[0].topic = "/camera/color/image_rect";
  EXPECT_EQ(choose_camera(facts, {}).camera, some_camera(380));
}

TEST(CameraFacts, ARecordingOfOnlyDepthImagesIsNamed) {
  CameraFacts facts = a_robot();
  facts.views[0].topic = "/camera/depth/image_rect_raw/compressedDepth";
  facts.views.push_back({"/tags", "camera_color_optical_frame", false, {}});
  const auto error = only_depth_images(facts);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->place.key, "/camera/depth/image_rect_raw/compressedDepth");
  facts.views.push_back({"/camera/color/image_raw", "camera_color_optical_frame", true, "rgb8"});
  EXPECT_FALSE(only_depth_images(facts));
  EXPECT_FALSE(only_depth_images({})) << "no images";
}

TEST(ImageCameras, EachCameraHasItsOwnCalibration) {
  CameraFacts facts = a_robot();
  facts.views.push_back({"/camera/color/image_raw/compressed", "camera_color_optical_frame", true, {}});
  facts.views.push_back(
      {"/camera/aligned/image_raw/compressedDepth", "camera_color_optical_frame", true, {}});
  using Cameras = std::map<std::string, CameraModel>;
  const std::string color = ros2::camera_of_frame("camera_color_optical_frame");
  EXPECT_EQ(image_cameras(facts), (Cameras{{color, some_camera()}}));
  facts.views.push_back({"/camera/infra1/image_rect_raw", "camera_infra1_optical_frame", true, "mono8"});
  EXPECT_EQ(image_cameras(facts), (Cameras{{color, some_camera()}})) << "no calibration of infra1";
  facts.infos.push_back({"/camera/infra1/camera_info", "camera_infra1_optical_frame", some_camera(500)});
  const std::string infra1 = ros2::camera_of_frame("camera_infra1_optical_frame");
  EXPECT_EQ(image_cameras(facts), (Cameras{{color, some_camera()}, {infra1, some_camera(500)}}));
}

TEST(ImageCameras, RawAndRectifiedImagesOfOneCameraHaveNone) {
  CameraFacts facts = a_robot();
  facts.infos[0].rectified = some_camera(380);
  facts.views.push_back({"/camera/color/image_rect", "camera_color_optical_frame", true, {}});
  EXPECT_THAT(image_cameras(facts), IsEmpty());
  facts.views.erase(facts.views.begin());
  EXPECT_EQ(image_cameras(facts).begin()->second, some_camera(380));
}

TEST(CameraChoice, OneOdometryAndOneImuAreUsed) {
  CameraFacts facts = a_robot();
  facts.motions.push_back({"/odometry/filtered", "base_link", false});
  facts.motions.push_back({"/camera/imu", "camera_imu_optical_frame", true});
  facts.frames.add("camera_link", "camera_imu_optical_frame", kOpticalTurn);
  const ChosenCamera chosen = choose_camera(facts, {});
  EXPECT_FALSE(chosen.ambiguous);
  EXPECT_THAT(chosen.unused, Contains("/odometry/filtered"));
  ASSERT_TRUE(chosen.base_R_imu);
  EXPECT_LT((*chosen.base_R_imu * Eigen::Vector3d(0, -1, 0) - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_THAT(choose_camera(facts, {.odometry_topic = "/odometry/filtered"}).unused, Contains("/odom"));
  EXPECT_TRUE(choose_camera(facts, {.odometry_topic = "/nothing"}).ambiguous);
  facts.motions[0].topic = "/wheels";
  EXPECT_TRUE(choose_camera(facts, {}).ambiguous);
}

/// A robot without nav_msgs/Odometry whose transforms lead from odom to its base.
CameraFacts a_robot_with_transforms(const std::string& base = "base_link") {
  CameraFacts facts = a_robot();
  facts.motions = {{"/tf", base, false, "odom"}};
  return facts;
}

TEST(CameraChoice, TransformsFromOdomAreTheOdometryIfNoTopicIs) {
  const ChosenCamera chosen = choose_camera(a_robot_with_transforms(), {});
  EXPECT_EQ(chosen.odometry, "/tf (odom to base_link)");
  EXPECT_EQ(chosen.odometry_frames, (OdometryFrames{"/tf", "odom", "base_link"}));
  EXPECT_FALSE(chosen.ambiguous);
  ASSERT_EQ(chosen.notes.size(), 1U);
  testing::expect_on_page("recording", chosen.notes[0]);
  CameraFacts both = a_robot_with_transforms();
  both.motions.push_back({"/odom", "base_link", false});
  EXPECT_EQ(choose_camera(both, {}).odometry, "/odom") << "the topic takes precedence";
  EXPECT_FALSE(choose_camera(both, {}).odometry_frames);
  EXPECT_EQ(choose_camera(a_robot(), {}).odometry, "/odom");
  EXPECT_EQ(choose_camera(a_robot_with_transforms("arm_link"), {}).odometry, "") << "not a base";
}

TEST(CameraChoice, TheBaseIsTheChildFrameOfTheTransformsThatAreOdometry) {
  CameraFacts facts = a_robot_with_transforms("base_footprint");
  facts.frames = {};
  facts.frames.add("base_footprint", "base_link", SE3(SO3(), {0, 0, 0.05}));
  facts.frames.add("base_link", "camera_color_optical_frame", kUp * kTurned * kOpticalTurn);
  const ChosenCamera chosen = choose_camera(facts, {});
  EXPECT_EQ(chosen.base_frame, "base_footprint");
  ASSERT_TRUE(chosen.base_T_cam);
  expect_same(*chosen.base_T_cam, SE3(SO3(), {0, 0, 0.05}) * kUp * kTurned * kOpticalTurn);
}

TEST(CameraChoice, TransformsOfSeveralBasesAreNotedUnlessOneIsChosen) {
  CameraFacts facts = a_robot_with_transforms("r1/base_link");
  facts.motions[0].parent = "r1/odom";
  facts.motions.push_back({"/tf", "r2/base_link", false, "r2/odom"});
  const ChosenCamera chosen = choose_camera(facts, {});
  EXPECT_FALSE(chosen.ambiguous) << "a recording without odometry can be read";
  EXPECT_EQ(chosen.odometry, "");
  EXPECT_FALSE(chosen.odometry_frames);
  EXPECT_TRUE(chosen.base_T_cam);
  ASSERT_EQ(chosen.notes.size(), 1U);
  testing::expect_on_page("recording", chosen.notes[0]);
  const ChosenCamera second = choose_camera(facts, {.base_frame = "/r2/base_link"});
  EXPECT_FALSE(second.ambiguous);
  EXPECT_EQ(second.odometry_frames, (OdometryFrames{"/tf", "r2/odom", "r2/base_link"}));
  facts.motions.push_back({"/tf", "chassis", false, "odom"});
  EXPECT_EQ(choose_camera(facts, {.base_frame = "chassis"}).odometry, "/tf (odom to chassis)");
  facts.frames = {};
  facts.frames.add("r2/base_link", "camera_color_optical_frame", kUp * kOpticalTurn);
  EXPECT_EQ(choose_camera(facts, {}).odometry, "/tf (r2/odom to r2/base_link)") << "it carries the camera";
}

TEST(CameraChoice, OneOfSeveralTransformsToTheBaseIsUsed) {
  CameraFacts facts = a_robot_with_transforms();
  facts.motions.push_back({"/tf", "base_link", false, "vo/odom"});
  EXPECT_EQ(choose_camera(facts, {}).odometry, "/tf (odom to base_link)");
  facts.motions = {{"/robot1/tf", "base_link", false, "odom"}, {"/robot2/tf", "base_link", false, "odom"}};
  EXPECT_EQ(choose_camera(facts, {}).odometry, "");
  EXPECT_FALSE(choose_camera(facts, {}).ambiguous);
  EXPECT_EQ(choose_camera(facts, {.odometry_topic = "/robot2/tf"}).odometry,
            "/robot2/tf (odom to base_link)");
  const ChosenCamera other = choose_camera(facts, {.odometry_topic = "/robot3/tf"});
  ASSERT_TRUE(other.ambiguous);
  testing::expect_on_page("recording", *other.ambiguous);
}

TEST(CameraChoice, TransformsThatNeverChangeAreNotOdometry) {
  CameraFacts facts = a_robot_with_transforms();
  facts.motions[0].only_pose = SE3();
  const ChosenCamera chosen = choose_camera(facts, {});
  EXPECT_FALSE(chosen.odometry_frames);
  EXPECT_EQ(chosen.odometry, "");
  ASSERT_EQ(chosen.notes.size(), 1U);
  testing::expect_on_page("recording", chosen.notes[0]);
  EXPECT_FALSE(all_moved(facts, {}));
  EXPECT_TRUE(choose_camera(facts, {.quick = true}).odometry_frames) << "it may drive later";
  facts.motions.push_back({"/tf", "base_footprint", false, "odom"});
  EXPECT_EQ(choose_camera(facts, {}).odometry, "/tf (odom to base_footprint)");
}

TEST(CameraFacts, ATransformThatChangesHasNoOnlyPose) {
  CameraFacts facts;
  const auto add = [&](const char* topic, const char* parent, double x_m) {
    const ros2::TFMessage message{{ros2::to_ros_transform({}, parent, "base_link", SE3(SO3(), {x_m, 0, 0}))}};
    ASSERT_TRUE(add_odometry_frames(facts, topic, ros2::TFMessage::kType, cdr::encode(message)));
  };
  for (int i = 0; i < 3; ++i) {
    add("/tf", "odom", 0.5);
    add("/tf", "vo/odom", 0.1 * i);
    add("/r2/tf", "odom", 0.2);
  }
  ASSERT_EQ(facts.motions.size(), 3U) << "the topic, the parent and the child identify a source";
  EXPECT_TRUE(facts.motions[0].only_pose);
  EXPECT_FALSE(facts.motions[1].only_pose);
  EXPECT_TRUE(facts.motions[2].only_pose);
}

TEST(CameraFacts, TheChildrenOfOdomAreFoundInTransforms) {
  const SensorTime stamp{};
  const ros2::TFMessage message{{ros2::to_ros_transform(stamp, "map", "odom", SE3()),
                                 ros2::to_ros_transform(stamp, "/odom", "/base_link", SE3()),
                                 ros2::to_ros_transform(stamp, "r1/odom", "r1/base_footprint", SE3()),
                                 ros2::to_ros_transform(stamp, "base_link", "wheel", SE3())}};
  CameraFacts facts;
  for (int i = 0; i < 2; ++i)
    ASSERT_TRUE(add_odometry_frames(facts, "/tf", ros2::TFMessage::kType, cdr::encode(message)));
  ASSERT_EQ(facts.motions.size(), 2U);
  EXPECT_EQ(facts.motions[0].frame, "base_link");
  EXPECT_EQ(facts.motions[0].parent, "odom");
  EXPECT_EQ(facts.motions[1].frame, "r1/base_footprint");
  EXPECT_FALSE(add_odometry_frames(facts, "/tf", ros2::TFMessage::kType, ByteSpan()));
}

}  // namespace
}  // namespace waymark
