// Tests the setup derived from a recorded lap, overrides by the caller or a robot file, and missing data.
#include "waymark/app/common/lap_input.hpp"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/recorded_lap.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/base/random.hpp"
#include "waymark/config/yaml/robot_file.hpp"

namespace waymark {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

RobotDescription lap_robot() { return read_robot(WAYMARK_SHARE "/robots/limo.yaml").value(); }

/// A lap whose recording contains all metadata.
RecordedLap whole_lap() {
  RecordedLap lap;
  lap.setup.camera = lap_robot().camera;
  lap.setup.base_T_cam = lap_robot().model.base_T_cam;
  lap.setup.metadata[lap_facts::kMetadata] = {{lap_facts::kAnchor, "tag36h11:4"},
                                              {lap_facts::kTagSize, "0.2"},
                                              {lap_facts::kAnchorPose, "1 2 0.3 0 0 0 1"}};
  return lap;
}

Error setup_error(const RecordedLap& lap, const SetupOverrides& overrides = {}) {
  const auto setup = setup_of(lap, overrides);
  EXPECT_FALSE(setup);
  return setup ? Error{} : setup.error();
}

TEST(TagsNamed, ReadsCommaSeparatedLists) {
  const auto tags = tags_named({"3,tag25h9:7", "9"}, "floor");
  ASSERT_TRUE(tags) << to_string(tags.error());
  EXPECT_THAT(*tags, ElementsAre(TagId{FamilyId::Tag36h11, 3}, TagId{FamilyId::Tag25h9, 7},
                                 TagId{FamilyId::Tag36h11, 9}));
  EXPECT_THAT(*tags_named({}, "floor"), IsEmpty());
  for (const char* text : {"", "wall", "3,wall", "3,,4", "tag99:1"}) {
    const auto wrong = tags_named({"1", text}, "floor");
    ASSERT_FALSE(wrong) << text;
    EXPECT_EQ(wrong.error().place.key, "floor");
  }
}

// Roll, pitch and yaw follow REP 103: rotations about the fixed axes x, y and z, in this order.
TEST(AnchorPose, AnglesAreRotationsAboutFixedAxes) {
  Random random(20261124);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<double> n;
    for (int i = 0; i < 3; ++i) n.push_back(random.uniform(-20, 20));
    for (int i = 0; i < 3; ++i) n.push_back(random.uniform(-180, 180));
    const auto pose = anchor_pose_of(n);
    ASSERT_TRUE(pose);
    const auto about = [&](const Eigen::Vector3d& axis, double deg) {
      return Eigen::AngleAxisd(to_radians(deg), axis);
    };
    const Eigen::Matrix3d expected =
        (about(Eigen::Vector3d::UnitZ(), n[5]) * about(Eigen::Vector3d::UnitY(), n[4]) *
         about(Eigen::Vector3d::UnitX(), n[3]))
            .toRotationMatrix();
    EXPECT_NEAR((pose->rotation().quaternion().toRotationMatrix() - expected).norm(), 0, 1e-12);
    EXPECT_EQ(pose->translation(), Eigen::Vector3d(n[0], n[1], n[2]));
  }
}

TEST(AnchorPose, InvalidPosesAreRefused) {
  const double inf = std::numeric_limits<double>::infinity();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::vector<double>> poses = {
      {nan, 0, 0, 0, 0, 0}, {0, 0, 0, 0, 0, inf}, {1.1e4, 0, 0, 0, 0, 0}, {0, 0, -1.1e4, 0, 0, 0}, {1, 2, 3}};
  for (const auto& pose : poses) {
    const auto refused = anchor_pose_of(pose);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().place.key, "anchor_pose");
  }
  EXPECT_TRUE(anchor_pose_of({9999, -9999, 0, 720, 0, 0}));
}

TEST(SetupOf, UsesTheRecording) {
  const auto setup = setup_of(whole_lap(), {});
  ASSERT_TRUE(setup) << to_string(setup.error());
  EXPECT_EQ(setup->anchor, (TagId{FamilyId::Tag36h11, 4}));
  EXPECT_EQ(setup->sizes.default_size_m, 0.2);
  EXPECT_EQ(setup->map_T_anchor.translation(), Eigen::Vector3d(1, 2, 0.3));
  EXPECT_TRUE(setup->anchor_pose_given);
}

TEST(SetupOf, TheCallerOverridesTheRecording) {
  const SE3 there(SO3::from_rpy(0, 0, 1), {5, 6, 7});
  const auto setup =
      setup_of(whole_lap(), {.anchor = "tag25h9:3", .map_T_anchor = there, .tag_size_m = 0.08});
  ASSERT_TRUE(setup);
  EXPECT_EQ(setup->anchor, (TagId{FamilyId::Tag25h9, 3}));
  EXPECT_EQ(setup->sizes.default_size_m, 0.08);
  EXPECT_EQ(setup->map_T_anchor.translation(), there.translation());
}

TEST(SetupOf, SizesOfTagsOfOtherFamiliesAreRefused) {
  const TagId observed{FamilyId::Tag25h9, 3};
  const TagId other{FamilyId::Tag36h11, 3};
  RecordedLap lap = whole_lap();
  lap.frames.emplace_back().detections = {TagDetection{.tag = observed}};
  EXPECT_TRUE(setup_of(lap, {.size_by_tag_m = {{observed, 0.08}}}));
  const Error error = setup_error(lap, {.size_by_tag_m = {{other, 0.08}}});
  EXPECT_EQ(error.place.key, "tag_size_m");
  EXPECT_THAT(error.hint, HasSubstr("tag25h9:3=0.08"));
}

TEST(SetupOf, AnAnchorOtherThanTheRecordedOneIsAtTheOrigin) {
  const auto other = setup_of(whole_lap(), {.anchor = "7"});
  ASSERT_TRUE(other);
  EXPECT_EQ(other->anchor, (TagId{FamilyId::Tag36h11, 7}));
  EXPECT_FALSE(other->anchor_pose_given) << "the pose in the recording is that of tag 4";
  EXPECT_EQ(other->map_T_anchor.translation(), Eigen::Vector3d::Zero());
  const auto same = setup_of(whole_lap(), {.anchor = "4"});
  ASSERT_TRUE(same);
  EXPECT_TRUE(same->anchor_pose_given) << "the same tag, specified by its ID";
}

TEST(SetupOf, AnAnchorAtTheOriginIsUpright) {
  const SE3 pose = anchor_at_origin();
  EXPECT_LT((pose.rotation() * Eigen::Vector3d(0, -1, 0) - Eigen::Vector3d::UnitZ()).norm(), 1e-12)
      << "the upward direction of the tag is up in the map";
  EXPECT_LT((pose.rotation() * Eigen::Vector3d(0, 0, 1) - Eigen::Vector3d::UnitX()).norm(), 1e-12)
      << "the direction into the tag is ahead in the map";
}

TEST(SetupOf, MissingDataAreErrorsWithAHint) {
  RecordedLap lap = whole_lap();
  lap.setup.metadata[lap_facts::kMetadata].erase(lap_facts::kTagSize);
  EXPECT_THAT(setup_error(lap).hint, HasSubstr("`tag_size_m`"));
  lap = whole_lap();
  lap.setup.metadata.clear();
  EXPECT_THAT(setup_error(lap, {.tag_size_m = 0.1}).hint, HasSubstr("`anchor`"));
  lap = whole_lap();
  lap.setup.base_T_cam.reset();
  EXPECT_THAT(setup_error(lap).hint, HasSubstr("`robot`"));
  lap.setup.chosen.mounting_error = Error{ErrorCode::NotFound, "no frame 'base'", {}, "Name it."};
  EXPECT_THAT(setup_error(lap).message, HasSubstr("no frame 'base'"));
  lap = whole_lap();
  lap.setup.camera.reset();
  lap.setup.problems.push_back({ErrorCode::Unreadable, "cut after 3 bytes", {}, {}});
  EXPECT_THAT(setup_error(lap).message, HasSubstr("cut after 3 bytes")) << "it may be truncated";
}

TEST(SetupOf, InvalidMetadataAreErrors) {
  RecordedLap lap = whole_lap();
  auto& facts = lap.setup.metadata[lap_facts::kMetadata];
  for (const char* size : {"0", "-0.1", "nan", "large", "16"}) {
    facts[lap_facts::kTagSize] = size;
    EXPECT_FALSE(setup_of(lap, {})) << size;
  }
  facts[lap_facts::kTagSize] = "0.16";
  for (const char* pose : {"", "1 2 3", "1 2 3 0 0 0 0", "1 2 3 a 0 0 1", "1 2 3 0 0 0 1 5"}) {
    facts[lap_facts::kAnchorPose] = pose;
    EXPECT_FALSE(setup_of(lap, {})) << pose;
  }
  EXPECT_TRUE(setup_of(lap, {.map_T_anchor = SE3()})) << "a specified pose replaces it";
  facts[lap_facts::kAnchor] = "tag99h1:0";
  EXPECT_FALSE(setup_of(lap, {}));
}

TEST(SetupOf, TagsOfAnotherSizeComeFromRecordingOrCaller) {
  const TagId small{FamilyId::Tag36h11, 5};
  const TagId large{FamilyId::Tag36h11, 6};
  RecordedLap lap = whole_lap();
  auto& facts = lap.setup.metadata[lap_facts::kMetadata];
  const TagSizes sizes{0.2, {{small, 0.12}, {large, 0.3}, {{FamilyId::Tag36h11, 7}, 0.2}}};
  add_tag_sizes(sizes, facts);
  EXPECT_EQ(facts[lap_facts::kTagSizes], "tag36h11:5=0.12 tag36h11:6=0.3") << "7 has the default size";
  EXPECT_EQ(setup_of(lap, {})->sizes, (TagSizes{0.2, {{small, 0.12}, {large, 0.3}}}));
  EXPECT_EQ(setup_of(lap, {.tag_size_m = 0.25, .size_by_tag_m = {{small, 0.1}}})->sizes,
            (TagSizes{0.25, {{small, 0.1}, {large, 0.3}}}));
  facts[lap_facts::kTagSizes] = "tag36h11:5=wide";
  EXPECT_THAT(setup_error(lap).message, HasSubstr("tag_sizes_m"));
}

TEST(LapFacts, WorldAndRobotAreAttachmentsOfTheRecording) {
  RecordedLap lap = whole_lap();
  ASSERT_TRUE(true_world(lap));
  EXPECT_FALSE(*true_world(lap)) << "unknown world";
  EXPECT_FALSE(robot_yaml_of(lap));
  lap.attachments[lap_facts::kWorldFile] = test::file_text(WAYMARK_SHARE "/worlds/circuit24.yaml");
  lap.attachments[lap_facts::kRobotFile] = "name: limo\n";
  EXPECT_EQ((*true_world(lap))->tags.tags.size(), 24U);
  EXPECT_EQ(robot_yaml_of(lap), "name: limo\n");
  lap.attachments[lap_facts::kWorldFile] = "name: [";
  EXPECT_FALSE(true_world(lap)) << "a damaged world is an error, not an unknown one";
}

TEST(TagNamed, ANumberIsOfFamily36h11) {
  EXPECT_EQ(tag_named("7").value(), (TagId{FamilyId::Tag36h11, 7}));
  EXPECT_EQ(tag_named("tag25h9:3").value(), (TagId{FamilyId::Tag25h9, 3}));
  for (const char* none : {"", "x", "-1", "tag36h11:", "tag36h11:9999", "tag36h12:3"})
    EXPECT_FALSE(tag_named(none)) << none;
}

TEST(Disagreements, OnlyLargeDifferencesAreReported) {
  const RobotDescription robot = lap_robot();
  RecordingSetup setup{.camera = robot.camera, .base_T_cam = robot.model.base_T_cam};
  EXPECT_THAT(disagreements(robot, setup), IsEmpty());
  EXPECT_THAT(disagreements(robot, {}), IsEmpty()) << "the recording contains no setup";
  setup.base_T_cam = robot.model.base_T_cam * SE3(SO3(), {0.004, 0, 0});
  EXPECT_THAT(disagreements(robot, setup), IsEmpty()) << "within the accuracy of a ruler";
  setup.base_T_cam = robot.model.base_T_cam * SE3(SO3(), {0.03, 0, 0});
  ASSERT_EQ(disagreements(robot, setup).size(), 1U);
  EXPECT_THAT(disagreements(robot, setup)[0], HasSubstr("3.0 cm"));
  setup.camera =
      CameraModel::make(PinholeRadtan{.fx = 300, .fy = 300, .cx = 160, .cy = 120}, 320, 240).value();
  ASSERT_EQ(disagreements(robot, setup).size(), 2U);
  EXPECT_THAT(disagreements(robot, setup)[1], HasSubstr("320 x 240"));
}

TEST(TakeRobot, UsesTheFileAndReportsDifferences) {
  RecordingSetup setup;
  setup.base_T_cam = SE3(SO3(), {9, 0, 0});
  std::vector<std::string> warnings;
  ASSERT_TRUE(take_robot("", setup, warnings));
  EXPECT_EQ(setup.base_T_cam->translation().x(), 9) << "unchanged without a file";
  ASSERT_TRUE(take_robot("limo", setup, warnings));
  EXPECT_EQ(warnings.size(), 1U);
  EXPECT_EQ(setup.base_T_cam->translation(), lap_robot().model.base_T_cam.translation());
  EXPECT_TRUE(setup.camera);
  const Status typo = take_robot("limoo", setup, warnings);
  ASSERT_FALSE(typo);
  EXPECT_THAT(typo.error().hint, HasSubstr("limo"));
}

RecordingSetup recorded_by(const RobotDescription& robot) {
  RecordingSetup setup;
  setup.camera = robot.camera;
  setup.base_T_cam = robot.model.base_T_cam;
  setup.chosen.base_frame = "base_link";
  setup.chosen.camera_frame = "camera_optical";
  return setup;
}

CameraModel pinhole(double fx, double cx, double cy, int width = 640, int height = 480) {
  return CameraModel::make(PinholeRadtan{.fx = fx, .fy = fx, .cx = cx, .cy = cy}, width, height).value();
}

TEST(Disagreements, AreEmptyForTheSameRobotAndForARecordingWithoutSetup) {
  EXPECT_THAT(disagreements(lap_robot(), recorded_by(lap_robot())), IsEmpty());
  EXPECT_THAT(disagreements(lap_robot(), {}), IsEmpty());
}

TEST(Disagreements, ADifferentMountingIsReportedWithDistance) {
  RecordingSetup setup = recorded_by(lap_robot());
  setup.base_T_cam = SE3(SO3::from_rpy(0, 0, to_radians(3)) * setup.base_T_cam->rotation(),
                         setup.base_T_cam->translation() + Eigen::Vector3d(0, 0.12, 0));
  EXPECT_THAT(
      disagreements(lap_robot(), setup),
      ElementsAre(AllOf(HasSubstr("12.0 cm and 3.0 deg"), HasSubstr("(base_link to camera_optical)"))));
  setup.base_T_cam = SE3(lap_robot().model.base_T_cam.rotation(),
                         lap_robot().model.base_T_cam.translation() + Eigen::Vector3d(0, 0.004, 0));
  EXPECT_THAT(disagreements(lap_robot(), setup), IsEmpty()) << "4 mm are within the accuracy of a ruler";
}

TEST(Disagreements, AnotherLensIsReported) {
  RobotDescription robot = lap_robot();
  robot.camera = pinhole(400, 320, 240);
  RecordingSetup setup = recorded_by(robot);
  setup.camera = pinhole(400 * 1.01, 320, 240);
  EXPECT_THAT(disagreements(robot, setup),
              ElementsAre(AllOf(HasSubstr("focal length of 400.0 px"), HasSubstr("recording 404.0 px"))));
  setup.camera = pinhole(400, 324, 240);
  EXPECT_THAT(disagreements(robot, setup), ElementsAre(HasSubstr("(324.0, 240.0)")));
  setup.camera = pinhole(401, 322, 241);
  EXPECT_THAT(disagreements(robot, setup), IsEmpty())
      << "within the difference between two calibrations of the same camera";
  setup.camera = pinhole(800, 640, 480, 1280, 960);
  EXPECT_THAT(disagreements(robot, setup),
              ElementsAre(AllOf(HasSubstr("640 x 480"), HasSubstr("1280 x 960"))));
}

TEST(TakeRobot, TheFileOverridesTheRecordingWithAWarning) {
  RecordingSetup setup = recorded_by(lap_robot());
  setup.camera = pinhole(300, 320, 240);
  setup.base_T_cam = SE3();
  std::vector<std::string> warnings;
  ASSERT_TRUE(take_robot(WAYMARK_SHARE "/robots/limo.yaml", setup, warnings));
  EXPECT_EQ(setup.camera, lap_robot().camera);
  EXPECT_EQ(setup.base_T_cam->matrix(), lap_robot().model.base_T_cam.matrix());
  EXPECT_EQ(warnings.size(), 2U);
  ASSERT_TRUE(take_robot(WAYMARK_SHARE "/robots/limo-front-rear.yaml", setup, warnings));
  EXPECT_EQ(setup.more_cameras.size(), 1U) << "all cameras in the file";
}

TEST(TakeRobot, DoesNothingWithoutANameAndFailsOnAnUnknownOne) {
  RecordingSetup setup;
  std::vector<std::string> warnings;
  ASSERT_TRUE(take_robot("", setup, warnings));
  EXPECT_FALSE(setup.camera);
  const Status none = take_robot("limmo", setup, warnings);
  ASSERT_FALSE(none);
  EXPECT_THAT(to_string(none.error()), HasSubstr("limo")) << "the nearest name";
  const Status missing = take_robot("/nowhere/robot.yaml", setup, warnings);
  ASSERT_FALSE(missing);
  EXPECT_THAT(to_string(missing.error()), HasSubstr("/nowhere/robot.yaml"));
  EXPECT_FALSE(setup.camera) << "unchanged after an error";
  EXPECT_THAT(warnings, IsEmpty());
}

}  // namespace
}  // namespace waymark
