#include "waymark/robots/ros2/initial_pose.hpp"

#include <functional>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"

namespace waymark {
namespace {

using Message = ros2::PoseWithCovarianceStamped;

/// A message like those from RViz's "2D Pose Estimate".
Message of_rviz() {
  Message message{.header = {{}, "map"}};
  message.pose.pose = ros2::to_ros(lift(SE2(1.5, -2, 0.75)));
  message.pose.covariance[0] = message.pose.covariance[7] = 0.25;
  message.pose.covariance[35] = 0.06853891909122467;
  return message;
}

TEST(InitialPose, ReadsThePoseOfRviz) {
  const auto given = read_initial_pose(cdr::encode(of_rviz()));
  ASSERT_TRUE(given) << to_string(given.error());
  EXPECT_TRUE(given->map_T_base.matrix().isApprox(SE2(1.5, -2, 0.75).matrix(), 1e-12));
  EXPECT_EQ(given->covariance(0, 0), 0.25);
  EXPECT_EQ(given->covariance(2, 2), 0.06853891909122467);
  Message old = of_rviz();
  old.header.frame_id = "/map";
  old.pose.covariance[1] = old.pose.covariance[6] = 0.1;  // covariance between x and y
  old.pose.covariance[5] = old.pose.covariance[30] = 0.05;
  const auto correlated = read_initial_pose(cdr::encode(old));
  ASSERT_TRUE(correlated) << to_string(correlated.error());
  EXPECT_EQ(correlated->covariance(1, 0), 0.1);
  EXPECT_EQ(correlated->covariance(0, 2), 0.05);
}

TEST(InitialPose, RejectsInvalidPoses) {
  struct Case {
    const char* part;  ///< part of the error message
    std::function<void(Message&)> spoil;
  };
  constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Case cases[] = {
      {"'odom'", [](Message& m) { m.header.frame_id = "odom"; }},
      {"''", [](Message& m) { m.header.frame_id.clear(); }},
      {"finite", [](Message& m) { m.pose.pose.position.x = kNotANumber; }},
      {"finite", [](Message& m) { m.pose.pose.position.y = kInfinity; }},
      {"finite",
       [](Message& m) {
         m.pose.pose.orientation = {0, 0, 0, 0};
       }},
      {"finite", [](Message& m) { m.pose.pose.orientation.z = kNotANumber; }},
      {"upright",
       [](Message& m) {
         m.pose.pose.orientation = {1, 0, 0, 0};
       }},
      {"covariance", [](Message& m) { m.pose.covariance = {}; }},
      {"covariance", [](Message& m) { m.pose.covariance[35] = 0; }},
      {"covariance", [](Message& m) { m.pose.covariance[0] = -1; }},
      {"covariance", [](Message& m) { m.pose.covariance[7] = kNotANumber; }},
      {"covariance", [](Message& m) { m.pose.covariance[1] = 0.1; }},  // not symmetric
      {"covariance", [](Message& m) { m.pose.covariance[1] = m.pose.covariance[6] = 0.25; }},
  };
  for (const Case& one : cases) {
    Message message = of_rviz();
    one.spoil(message);
    const auto given = read_initial_pose(cdr::encode(message));
    ASSERT_FALSE(given) << one.part;
    EXPECT_EQ(given.error().place.source, kInitialPoseTopic);
    EXPECT_NE(given.error().message.find(one.part), std::string::npos) << given.error().message;
    testing::expect_on_page("robots", given.error());
  }
}

TEST(InitialPose, RejectsTruncatedMessages) {
  const auto bytes = cdr::encode(of_rviz());
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(read_initial_pose(std::span(bytes).first(size))) << size;
}

}  // namespace
}  // namespace waymark
