// Files written during a localizer run, and the report on it.
#include "waymark/app/localize/localize_output.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"
#include "waymark/app/common/estimate_message.hpp"
#include "waymark/app/common/trajectory_files.hpp"
#include "waymark/app/localize/localize_log.hpp"
#include "waymark/config/exchange/trajectory_file.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

SensorTime at_ms(int ms) { return SensorTime(std::chrono::milliseconds(ms)); }

LocalizationEstimate estimate(int ms, double x_m, bool certain = true) {
  Eigen::Matrix3d P = Eigen::Vector3d(1e-4, 4e-4, 9e-4).asDiagonal();
  P(0, 1) = P(1, 0) = 5e-5;
  return {.stamp = at_ms(ms), .map_T_base = SE2(x_m, 2, 0.5), .covariance = P, .certain = certain};
}

class Output : public ::testing::Test {
 protected:
  Result<LocalizeOutput> open(const std::string& name, const LocalizeSource& source = {
                                                           .name = "lap.mcap", .map = "somewhere/map.yaml"}) {
    path_ = name.empty() ? "" : (folder_ / name).string();
    return LocalizeOutput::open(path_, {}, source);
  }
  fs::path folder_ = testing::fresh_folder("jobs_output");
  std::string path_{};
};

TEST_F(Output, WritesCertainPosesAndCountsUncertainOnes) {
  auto output = open("poses.txt");
  ASSERT_TRUE(output) << to_string(output.error());
  EXPECT_TRUE(output->on_sample(Odometry{.stamp = at_ms(1000)}));
  EXPECT_TRUE(output->on_estimate(estimate(1500, 0, false)));
  EXPECT_TRUE(output->on_estimate(estimate(2500, 1)));
  EXPECT_TRUE(output->on_estimate(estimate(2500, 7))) << "a repeated timestamp is skipped";
  EXPECT_TRUE(output->on_estimate(estimate(2000, 7))) << "an older timestamp is skipped";
  EXPECT_TRUE(output->on_estimate(estimate(3000, 2)));
  EXPECT_TRUE(output->on_sample(Odometry{.stamp = at_ms(4000)}));
  const auto report = output->close(false);
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_EQ(report->estimates, 3U);
  EXPECT_EQ(report->certain, 2U);
  ASSERT_TRUE(report->first_fix_s);
  EXPECT_NEAR(*report->first_fix_s, 1.5, 1e-9);
  EXPECT_NEAR(report->duration_s, 3, 1e-9);
  EXPECT_EQ(report->last->map_T_base.x(), 2);
  const auto poses = read_trajectory(path_);
  ASSERT_TRUE(poses) << to_string(poses.error());
  ASSERT_EQ(poses->size(), 2U);
  EXPECT_EQ((*poses)[0].stamp, at_ms(2500));
  EXPECT_NEAR((*poses)[1].map_T_base.translation().x(), 2, 1e-6);
}

TEST_F(Output, WritesNoPosesIfTheRunFailed) {
  auto output = open("poses.tum");
  ASSERT_TRUE(output);
  EXPECT_TRUE(output->on_estimate(estimate(100, 1)));
  EXPECT_TRUE(output->close(true));
  EXPECT_THAT(test::names_in(folder_), IsEmpty());
}

TEST_F(Output, RecordsEstimatesAndComparisons) {
  auto output = open("estimate.mcap");
  ASSERT_TRUE(output) << to_string(output.error());
  EXPECT_TRUE(output->on_sample(Odometry{.stamp = at_ms(1000)}));
  EXPECT_TRUE(output->on_sample(TagFrame{.stamp = at_ms(1100)}));
  EXPECT_TRUE(output->on_estimate(estimate(1200, 1)));
  EXPECT_TRUE(output->on_estimate(estimate(1300, 1, false)));
  const TagId tag{FamilyId::Tag36h11, 3};
  EXPECT_TRUE(
      output->on_comparison({.stamp = at_ms(1200), .tag = tag, .nis = 4, .rows = 8, .accepted = true}));
  EXPECT_TRUE(
      output->on_comparison({.stamp = at_ms(1250), .tag = tag, .nis = 400, .rows = 8, .accepted = false}));
  const auto report = output->close(false);
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_EQ(report->compared, 2U);
  EXPECT_EQ(report->accepted, 1U);
  EXPECT_NEAR(report->nis_mean, 0.5, 1e-12) << "only accepted observations count, per degree of freedom";
  const auto poses = read_estimate(path_, "");
  ASSERT_TRUE(poses) << to_string(poses.error());
  EXPECT_EQ(poses->size(), 1U);
  const auto nis = read_nis(path_, at_ms(0), at_ms(9000));
  ASSERT_TRUE(nis);
  EXPECT_NEAR(nis->mean, 0.5, 1e-3);
  EXPECT_EQ(nis->rejected, 1U);
  EXPECT_EQ(count_uncertain(path_, at_ms(0), at_ms(9000)), 1U);
}

TEST_F(Output, FailsAtTheStartIfItCannotBeWritten) {
  std::ofstream(folder_ / "there.txt") << "older";
  const auto there = open("there.txt");
  ASSERT_FALSE(there);
  EXPECT_EQ(there.error().code, ErrorCode::Unwritable);
  EXPECT_EQ(test::file_text(folder_ / "there.txt"), "older");
  const auto nameless = open("estimate.bin");
  ASSERT_FALSE(nameless);
  EXPECT_EQ(nameless.error().place.key, "`output`");
  EXPECT_FALSE(check_localize_output("/nowhere/poses.txt"));
  EXPECT_TRUE(check_localize_output("")) << "an empty path means no output";
  EXPECT_TRUE(open(""));
}

TEST(RecordedImages, NeedARecording) {
  EXPECT_TRUE(check_recorded_images("", ""));
  EXPECT_TRUE(check_recorded_images("jpeg", "live.mcap"));
  const Status refused = check_recorded_images("jpeg", "");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().place.key, "record_images");
}

TEST(EstimateMessage, HasTheCovarianceOfXYAndYaw) {
  const auto message = estimate_message(estimate(1234, 1));
  EXPECT_EQ(message.header.frame_id, "map");
  EXPECT_EQ(message.pose.covariance[0], 1e-4);
  EXPECT_EQ(message.pose.covariance[7], 4e-4);
  EXPECT_EQ(message.pose.covariance[35], 9e-4);
  EXPECT_EQ(message.pose.covariance[1], 5e-5);
  EXPECT_EQ(message.pose.covariance[6], 5e-5);
  EXPECT_EQ(message.pose.covariance[14], 0) << "z";
  const auto nis = nis_message({.stamp = at_ms(5), .tag = {FamilyId::Tag36h11, 9}, .nis = 2.5, .rows = 8});
  ASSERT_EQ(nis.status.size(), 1U);
  EXPECT_EQ(nis.status[0].name, "tag36h11:9");
  EXPECT_EQ(nis.status[0].message, "rejected");
  EXPECT_EQ(nis.status[0].level, 1);
}

TEST(LocalizeText, ContainsCountsPoseAndNis) {
  LocalizeReport report{.estimates = 4, .certain = 3, .first_fix_s = 1.25, .compared = 20, .accepted = 19};
  report.nis_mean = 1.1;
  report.duration_s = 12;
  report.last = estimate(100, 1);
  const std::string text = to_text(report);
  EXPECT_THAT(
      text, AllOf(HasSubstr("4 estimates in 12.0 s, 75.0 % of them certain, the first after 1.25 s"),
                  HasSubstr("19 of 20 observations accepted, NIS 1.10"), HasSubstr("x 1.000 m, y 2.000 m")));
  EXPECT_THAT(localization_warnings(report), IsEmpty());
  EXPECT_THAT(to_text(LocalizeReport{}),
              AllOf(HasSubstr("no estimate within 0.0 s\n"), Not(HasSubstr("nan"))));
}

TEST(LocalizeReport, UnknownValuesAreNull) {
  LocalizeReport report{.method = LocalizationKind::Ekf, .estimates = 4, .certain = 3};
  EXPECT_EQ(
      to_json(fields(report)).dump(),
      R"({"method":"ekf","estimates":4,"certain":3,"first_fix_s":null,"observations":0,"accepted":0,)"
      R"("nis_mean":0.0,"lasting_nis":null,"duration_s":0.0,"wall_s":0.0,"last":null,"sensors":[],"problems":[]})");
  report.last = LocalizationEstimate{.map_T_base = SE2(1, 2, 0.5), .certain = false};
  EXPECT_EQ(to_json(fields(report))["last"].dump(), R"({"x_m":1.0,"y_m":2.0,"yaw_rad":0.5,"certain":false})");
}

TEST(LocalizeText, WarningsNameRemedies) {
  LocalizeReport report{.estimates = 4, .certain = 0, .compared = 100, .accepted = 9};
  report.lasting_nis = 5;
  EXPECT_THAT(
      localization_warnings(report),
      ElementsAre("no certain estimate", HasSubstr("waymark calibrate robot"), HasSubstr("`calibration`")));
  report.accepted = 10;
  report.certain = 1;
  report.lasting_nis = 4;
  EXPECT_THAT(localization_warnings(report), IsEmpty());
}

}  // namespace
}  // namespace waymark
