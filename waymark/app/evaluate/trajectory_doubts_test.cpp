// When a comparison of two trajectories is doubtful, and when nothing is to be said.
#include "waymark/app/evaluate/trajectory_doubts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/recorded_lap.hpp"
#include "waymark/config/trajectory_file.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A circle of 2 m about a place, ten poses a second.
Trajectory circle(double from_s, double to_s, double x_m = 0) {
  Trajectory path;
  for (int i = static_cast<int>(10 * from_s); i <= static_cast<int>(10 * to_s); ++i)
    path.push_back({SensorTime(Duration(i * 100'000'000LL)),
                    lift(SE2(x_m + 2 * std::cos(0.02 * i), 2 * std::sin(0.02 * i), 0.02 * i))});
  return path;
}

class TrajectoryDoubts : public ::testing::Test {
 protected:
  [[nodiscard]] std::string tum(const std::string& name, const Trajectory& path) const {
    EXPECT_TRUE(write_text_file(folder_ / name, to_tum(path)));
    return (folder_ / name).string();
  }
  static std::vector<std::string> doubts(const EvaluateTrajectoryJob& job) {
    const auto inputs = read_evaluation(job, {});
    EXPECT_TRUE(inputs) << to_string(inputs.error());
    const auto report = evaluate_trajectory(job, *inputs, {});
    EXPECT_TRUE(report) << to_string(report.error());
    return doubts_about(*report, inputs->reference);
  }
  fs::path folder_ = testing::fresh_folder("jobs_doubts");
};

TEST_F(TrajectoryDoubts, NothingIsSaidOfAnErrorThatMayBe) {
  EXPECT_THAT(doubts({.estimate = tum("a.txt", circle(0, 30)), .reference = tum("b.txt", circle(0, 30))}),
              IsEmpty());
  EXPECT_THAT(
      doubts({.estimate = tum("a.txt", circle(0, 30, 0.25)), .reference = tum("b.txt", circle(0, 30))}),
      IsEmpty())
      << "a quarter of a metre is an error and no other place";
}

TEST_F(TrajectoryDoubts, HardlyAMomentInCommon) {
  const std::string reference = tum("b.txt", circle(0, 30));
  EXPECT_THAT(doubts({.estimate = tum("a.txt", circle(20, 60)), .reference = reference}),
              ElementsAre(HasSubstr("only 101 of 401 poses of EST")));
  EXPECT_THAT(doubts({.estimate = tum("a.txt", circle(10, 40)), .reference = reference}), IsEmpty())
      << "two thirds are";
}

TEST_F(TrajectoryDoubts, AnotherPlaceUnlessItIsAligned) {
  EvaluateTrajectoryJob job{.estimate = tum("a.txt", circle(0, 30, 5)),
                            .reference = tum("b.txt", circle(0, 30))};
  EXPECT_THAT(doubts(job), ElementsAre(HasSubstr("EST is 5.0 m from REF")));
  job.alignment = "se2";
  EXPECT_THAT(doubts(job), IsEmpty());
}

TEST_F(TrajectoryDoubts, TwoDrivesAreToldByTheirOdometry) {
  const auto lap = [&](const char* name, std::uint64_t seed) {
    return test::record_lap(folder_ / name, seed, {.for_s = 8});
  };
  EvaluateTrajectoryJob job{.estimate = lap("a.mcap", 1),
                            .reference = lap("b.mcap", 2),
                            .estimate_topic = topics::kTruth,
                            .reference_topic = topics::kTruth};
  EXPECT_THAT(doubts(job), Contains(HasSubstr("EST and REF are of two drives")));
  job.reference = lap("c.mcap", 1);
  EXPECT_THAT(doubts(job), IsEmpty()) << "the same seed drives the same lap";
}

}  // namespace
}  // namespace waymark
