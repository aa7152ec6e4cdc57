// Tests reading trajectories, references and NIS from files in all formats.
#include "waymark/app/common/trajectory_files.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/recorded_lap.hpp"
#include "waymark/app/common/estimate_message.hpp"
#include "waymark/app/evaluate/evaluate_trajectory.hpp"
#include "waymark/config/yaml/route_file.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

SensorTime at_second(double s) { return SensorTime(Duration(std::llround(s * 1e9))); }

LocalizationEstimate estimate_at(double s, double x_m) {
  LocalizationEstimate estimate{.stamp = at_second(s), .map_T_base = SE2(x_m, 1, 0.5)};
  estimate.covariance << 1, 0.1, 0.2, 0.1, 2, 0.3, 0.2, 0.3, 3;
  return estimate;
}

class TrajectoryFiles : public ::testing::Test {
 protected:
  [[nodiscard]] std::string text(const std::string& name, const std::string& words) const {
    EXPECT_TRUE(write_text_file(folder_ / name, words));
    return (folder_ / name).string();
  }
  /// A recording like those written by `waymark localize`, with estimates, uncertain estimates, NIS and
  /// odometry.
  [[nodiscard]] std::string estimates() const {
    const fs::path file = folder_ / "estimate.mcap";
    auto recorder = SampleRecorder::open(std::move(*create_file(file)));
    EXPECT_TRUE(recorder);
    for (int i = 0; i < 10; ++i) {
      const auto estimate = estimate_at(i, 0.1 * i);
      EXPECT_TRUE(recorder->add(Odometry{estimate.stamp, estimate.map_T_base, 0.1, 0}));
      EXPECT_TRUE(recorder->add(ImuSample{estimate.stamp, {0, 0, 0.1}, {0, 0, 9.8}}));
      EXPECT_TRUE(recorder->add_message(i < 3 ? kUncertainTopic : topics::kEstimate, estimate.stamp,
                                        estimate_message(estimate)));
      EXPECT_TRUE(recorder->add_message(
          kNisTopic, estimate.stamp,
          nis_message({.stamp = estimate.stamp, .nis = 8.0 + i, .rows = 8, .accepted = i != 9})));
    }
    EXPECT_TRUE(recorder->close());
    return file.string();
  }
  fs::path folder_ = testing::fresh_folder("jobs_trajectory_files");
};

TEST_F(TrajectoryFiles, EstimatesKeepTheirRecordedCovariance) {
  const auto read = read_estimate(estimates(), "");
  ASSERT_TRUE(read) << to_string(read.error());
  ASSERT_EQ(read->size(), 7U) << "uncertain estimates are not included";
  EXPECT_EQ(read->front().stamp, at_second(3));
  ASSERT_TRUE(read->front().covariance);
  EXPECT_EQ(*read->front().covariance, estimate_at(3, 0).covariance);
  EXPECT_NEAR(project_to_plane(read->front().map_T_base).yaw(), 0.5, 1e-12);
}

TEST_F(TrajectoryFiles, UncertainEstimatesAndNisAreCountedBetweenTwoTimes) {
  const std::string file = estimates();
  EXPECT_EQ(count_uncertain(file, at_second(0), at_second(100)), 3U);
  EXPECT_EQ(count_uncertain(file, at_second(1), at_second(1)), 1U);
  const auto nis = read_nis(file, at_second(0), at_second(100));
  ASSERT_TRUE(nis);
  EXPECT_EQ(nis->observations, 9U);
  EXPECT_EQ(nis->rejected, 1U);
  EXPECT_NEAR(nis->mean, 12.0 / 8, 1e-3) << "the mean of 8 … 16 divided by eight degrees of freedom";
  EXPECT_EQ(read_nis(file, at_second(0), at_second(1))->observations, 2U);
  EXPECT_FALSE(read_nis(file, at_second(50), at_second(100)));
  EXPECT_FALSE(read_nis("/nowhere", at_second(0), at_second(1)));
  EXPECT_EQ(count_uncertain(text("poses.txt", "1 0 0 0 0 0 0 1\n"), at_second(0), at_second(9)), 0U);
}

TEST_F(TrajectoryFiles, TheOnlyTopicIsChosenAndOneOfSeveralMustBeNamed) {
  const std::string file = estimates();
  const auto odometry = read_estimate(file, topics::kOdometry);
  ASSERT_TRUE(odometry);
  EXPECT_EQ(odometry->size(), 10U);
  const auto typo = read_estimate(file, "/odomm");
  ASSERT_FALSE(typo);
  EXPECT_THAT(typo.error().hint, HasSubstr("/odom"));
  const auto several = read_reference(file, "", false);
  ASSERT_FALSE(several) << "it contains no ground truth";
  EXPECT_THAT(several.error().hint, HasSubstr("`ref_topic`"));
}

TEST_F(TrajectoryFiles, PathsTrajectoriesAndRoutesAreReferences) {
  const auto corners = read_reference(text("path.csv", "x_m,y_m\n0,0\n2,0\n2,2\n"), "", true);
  ASSERT_TRUE(corners) << to_string(corners.error());
  EXPECT_THAT(corners->timed, IsEmpty());
  EXPECT_EQ(corners->path.corners.size(), 3U);
  EXPECT_TRUE(corners->path.closed);
  const auto tum =
      read_reference(text("poses.txt", "# t x y z q\n1 0 0 0 0 0 0 1\n2 3 4 0 0 0 0 1\n"), "", false);
  ASSERT_TRUE(tum) << to_string(tum.error());
  EXPECT_EQ(tum->timed.size(), 2U);
  EXPECT_EQ(tum->path.corners.back(), Eigen::Vector2d(3, 4));
  Route route{.length_m = 1};
  for (int i = 0; i <= 10; ++i)
    route.points.push_back({.map_T_base = SE2(0.1 * i, 0, 0), .arc_length_m = 0.1 * i, .speed_m_s = 0.3});
  ASSERT_TRUE(write_route(folder_ / "route.yaml", route));
  const auto of_route = read_reference((folder_ / "route.yaml").string(), "", false);
  ASSERT_TRUE(of_route) << to_string(of_route.error());
  EXPECT_EQ(of_route->path.corners.size(), 11U);
  EXPECT_FALSE(of_route->path.closed);
}

TEST_F(TrajectoryFiles, InvalidReferencesAreErrors) {
  const auto error = [&](const std::string& words) {
    const auto read = read_reference(text("bad", words), "", false);
    EXPECT_FALSE(read) << words;
    return read ? Error{} : read.error();
  };
  EXPECT_THAT(error("x,y\n1,2\n3,4\n").message, HasSubstr("x_m"));
  EXPECT_THAT(error("x_m,y_m\n1,2\n").message, HasSubstr("two points"));
  EXPECT_EQ(error("x_m,y_m\n1,2\n3,four\n").place.line, 3);
  EXPECT_FALSE(error("1 2 3\n").message.empty());
  EXPECT_FALSE(error("").message.empty());
  EXPECT_FALSE(error("neither this\nnor that\n").message.empty());
  EXPECT_FALSE(read_reference("/nowhere", "", false));
  EXPECT_FALSE(read_estimate(text("none.txt", "# nothing\n"), ""));
}

TEST_F(TrajectoryFiles, MotionIsOdometryAndGyroInOrderOfTime) {
  const auto motion = read_motion(estimates());
  ASSERT_TRUE(motion) << to_string(motion.error());
  EXPECT_EQ(motion->odometry.size(), 10U);
  EXPECT_EQ(motion->imu.size(), 10U);
  EXPECT_TRUE(std::ranges::is_sorted(motion->odometry, {}, &Odometry::stamp));
  const auto none = read_motion(text("ranges.csv", "t_s,landmark,range_m,bearing_rad\n1,1,1,0\n"));
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::NotFound);
}

TEST_F(TrajectoryFiles, CancellingEndsTheReading) {
  const std::string file = estimates();
  JobControl stop;
  stop.cancelled = [] { return true; };
  EXPECT_FALSE(read_motion(file, stop));
  EXPECT_FALSE(read_estimate(file, "", stop));
  EXPECT_FALSE(read_reference(file, topics::kOdometry, false, stop));
}

TEST(EstimateMessage, NisMessagesContainDegreesOfFreedomAndAcceptance) {
  const auto message =
      nis_message({.stamp = at_second(3), .tag = {FamilyId::Tag36h11, 7}, .nis = 4.5, .rows = 8});
  ASSERT_EQ(message.status.size(), 1U);
  EXPECT_EQ(message.status[0].name, "tag36h11:7");
  EXPECT_EQ(message.status[0].message, "rejected");
  EXPECT_EQ(message.status[0].level, 1);
  EXPECT_EQ(message.status[0].values[1].value, "8");
}

}  // namespace
}  // namespace waymark
