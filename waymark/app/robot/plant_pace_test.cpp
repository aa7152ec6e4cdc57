// Real time of a simulated robot on a computer that is late.
#include "waymark/app/robot/plant_pace.hpp"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace waymark {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class PlantPaceTest : public ::testing::Test {
 protected:
  Duration now_ = seconds(1000);
  std::vector<std::string> said_{};
  PlantPace pace_{[this] { return now_; }, seconds(2),
                  [this](const std::string& words) { said_.push_back(words); }};
};

TEST_F(PlantPaceTest, WaitsUntilTheClockIsWhereThePlantIs) {
  EXPECT_EQ(pace_.ahead(seconds(2)), Duration(0));
  EXPECT_EQ(pace_.ahead(seconds(3)), seconds(1));
  now_ += milliseconds(600);
  EXPECT_EQ(pace_.ahead(seconds(3)), milliseconds(400));
}

TEST_F(PlantPaceTest, MakesUpForALittle) {
  now_ += milliseconds(90);
  pace_.leave_out(seconds(2));
  EXPECT_EQ(pace_.left_out(), Duration(0));
  EXPECT_EQ(pace_.ahead(seconds(2) + milliseconds(100)), milliseconds(10));
  EXPECT_THAT(said_, IsEmpty());
}

TEST_F(PlantPaceTest, LeavesOutWhatWouldMakeTheRobotFast) {
  now_ += milliseconds(1600);
  pace_.leave_out(seconds(2));
  EXPECT_EQ(pace_.left_out(), milliseconds(1500));
  EXPECT_EQ(pace_.ahead(seconds(2) + milliseconds(100)), Duration(0));
  EXPECT_EQ(pace_.ahead(seconds(2) + milliseconds(150)), milliseconds(50));
  EXPECT_THAT(said_, ElementsAre(HasSubstr("paused for 1.50 s")));
}

TEST_F(PlantPaceTest, SaysAllOfItWithinTenSecondsAtOnce) {
  Duration uptime = seconds(2);
  for (int i = 0; i < 300; ++i) {  // half as fast as it should be, for 30 s
    now_ += milliseconds(100);
    uptime += milliseconds(50);
    pace_.leave_out(uptime);
  }
  EXPECT_EQ(pace_.left_out(), seconds(15) - milliseconds(100));
  EXPECT_THAT(said_, ElementsAre(HasSubstr("0.05 s"), HasSubstr("5.00 s"), HasSubstr("5.00 s")));
}

}  // namespace
}  // namespace waymark
