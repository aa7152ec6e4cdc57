// Where a robot's file and a recording say different things, which of them counts, and a robot in words.
#include "waymark/app/common/robot_setup.hpp"

#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/app/common/robot_text.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/config/robot_file.hpp"

namespace waymark {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

RobotDescription limo() { return read_robot(WAYMARK_SHARE "/robots/limo.yaml").value(); }

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

TEST(Disagreements, ThereAreNoneOfTheSameRobotNorOfASilentRecording) {
  EXPECT_THAT(disagreements(limo(), recorded_by(limo())), IsEmpty());
  EXPECT_THAT(disagreements(limo(), {}), IsEmpty());
}

TEST(Disagreements, ACameraThatSitsElsewhereIsNamedWithHowFar) {
  RecordingSetup setup = recorded_by(limo());
  setup.base_T_cam = SE3(SO3::from_rpy(0, 0, to_radians(3)) * setup.base_T_cam->rotation(),
                         setup.base_T_cam->translation() + Eigen::Vector3d(0, 0.12, 0));
  EXPECT_THAT(disagreements(limo(), setup),
              ElementsAre(AllOf(HasSubstr("12.0 cm and 3.0 deg"), HasSubstr("(base_link to camera_optical)"),
                                HasSubstr("the file is taken"))));
  setup.base_T_cam = SE3(limo().model.base_T_cam.rotation(),
                         limo().model.base_T_cam.translation() + Eigen::Vector3d(0, 0.004, 0));
  EXPECT_THAT(disagreements(limo(), setup), IsEmpty()) << "4 mm are what people measure";
}

TEST(Disagreements, AnotherLensIsNamedByWhatDiffersMost) {
  RobotDescription robot = limo();
  robot.camera = pinhole(400, 320, 240);
  RecordingSetup setup = recorded_by(robot);
  setup.camera = pinhole(400 * 1.01, 320, 240);
  EXPECT_THAT(disagreements(robot, setup),
              ElementsAre(AllOf(HasSubstr("focal length of 400.0 px"), HasSubstr("recording 404.0 px"))));
  setup.camera = pinhole(400, 324, 240);
  EXPECT_THAT(disagreements(robot, setup), ElementsAre(HasSubstr("(324.0, 240.0)")));
  setup.camera = pinhole(401, 322, 241);
  EXPECT_THAT(disagreements(robot, setup), IsEmpty()) << "as two calibrations of one camera differ";
  setup.camera = pinhole(800, 640, 480, 1280, 960);
  EXPECT_THAT(disagreements(robot, setup),
              ElementsAre(AllOf(HasSubstr("640 x 480"), HasSubstr("recording of 1280 x 960"))));
}

TEST(TakeRobot, TheFileCountsAndTheRecordingIsWarnedOf) {
  RecordingSetup setup = recorded_by(limo());
  setup.camera = pinhole(300, 320, 240);
  setup.base_T_cam = SE3();
  std::vector<std::string> warnings;
  ASSERT_TRUE(take_robot(WAYMARK_SHARE "/robots/limo.yaml", setup, warnings));
  EXPECT_EQ(setup.camera, limo().camera);
  EXPECT_EQ(setup.base_T_cam->matrix(), limo().model.base_T_cam.matrix());
  EXPECT_EQ(warnings.size(), 2U);
  ASSERT_TRUE(take_robot(WAYMARK_SHARE "/robots/limo-front-rear.yaml", setup, warnings));
  EXPECT_EQ(setup.more_cameras.size(), 1U) << "all cameras of the file";
}

TEST(TakeRobot, WithoutANameNothingHappensAndAWrongOneIsAnError) {
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
  EXPECT_FALSE(setup.camera) << "and nothing was taken";
  EXPECT_THAT(warnings, IsEmpty());
}

TEST(RobotText, TellsBodyLimitsWheelsAndEveryCamera) {
  RobotDescription robot = read_robot(WAYMARK_SHARE "/robots/limo-front-rear.yaml").value();
  robot.model.hull = {.front_m = 0.2, .rear_m = 0.1, .width_m = 0.22, .height_m = 0.25};
  robot.model.limits.yaw_rate_rad_s = to_radians(90);
  const std::string text = robot_text(robot, "From the maker's page.");
  EXPECT_THAT(text, HasSubstr(robot.model.name + "\nFrom the maker's page.\n"));
  EXPECT_THAT(text, HasSubstr("0.300 m long (0.100 m of it behind base_link), 0.220 m wide, 0.250 m high"));
  EXPECT_THAT(text, HasSubstr("(90 degrees/s)"));
  EXPECT_THAT(text, HasSubstr("camera front: "));
  EXPECT_THAT(text, HasSubstr("camera rear: "));
  EXPECT_THAT(text, ::testing::Not(HasSubstr("-0.0"))) << "no zero is negative";
}

TEST(RobotText, LongCommentsAreBrokenAtSpacesAndLoseNothing) {
  std::string comment;
  for (int i = 0; i < 60; ++i)
    comment += (i == 0 ? "" : " ") + std::string(1 + static_cast<std::size_t>(i % 11), 'x');
  std::istringstream lines(robot_text(limo(), comment));
  std::string line;
  std::string joined;
  std::getline(lines, line);  // the name
  while (std::getline(lines, line) && !line.starts_with("body:")) {
    EXPECT_LE(line.size(), 100U);
    joined += (joined.empty() ? "" : " ") + line;
  }
  EXPECT_EQ(joined, comment);
  const std::string word(230, 'w');
  EXPECT_THAT(robot_text(limo(), word),
              HasSubstr(std::string(100, 'w') + "\n" + std::string(100, 'w') + "\n"))
      << "a word without end is cut";
}

}  // namespace
}  // namespace waymark
