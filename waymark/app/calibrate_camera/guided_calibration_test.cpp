// What a guided calibration says of itself: on the terminal, and to the page.
#include "waymark/app/calibrate_camera/guided_calibration.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace waymark {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// Seven views: one tilted to the left, the corners of two parts of the picture not reached.
GuideStatus some_views(const GuideOptions& options) {
  GuideStatus status;
  status.picture = CaptureVerdict::Moving;
  status.coverage = {.views = 7, .corners = {0, 40, 40, 40, 40, 40, 40, 40, 19}, .tilts = {1, 1, 2, 2, 2}};
  status.in_picture = {5, 1, 0, 0, 0, 0, 0, 0, 0};
  status.missing = missing_views(status.coverage, options.coverage);
  status.held_out_rms_px = 0.21;
  status.focal_share = 0.003;
  return status;
}

TEST(GuidedCalibration, ALineNamesTheTiltsAndThePartsThatAreMissing) {
  EXPECT_EQ(
      to_text(some_views({})),
      "7 views, 0.21 px, focal length +- 0.3 %; hold still; wanted: tilt the board, its left edge nearer "
      "to the camera; hold it where it was not yet: top left, bottom right");
}

TEST(GuidedCalibration, BeforeTheFirstViewALineNamesBoth) {
  GuideStatus status;
  status.missing = missing_views(status.coverage, {});
  EXPECT_THAT(to_text(status), AllOf(HasSubstr("left, right, upper or lower edge"),
                                     HasSubstr("top left, top, top right"), Not(HasSubstr("px"))));
}

TEST(GuidedCalibration, JsonHasEveryPartAndTiltWithWhatIsWanted) {
  GuideOptions options;
  options.coverage.corners_each_part = 30;
  const auto json = to_json(some_views(options), options);
  EXPECT_EQ(json["picture"], "hold still");
  EXPECT_EQ(json["views"], 7);
  EXPECT_EQ(json["views_wanted"], 12);
  EXPECT_EQ(json["focal_sigma_share"], 0.003);
  EXPECT_EQ(json["focal_sigma_share_wanted"], 0.001);
  ASSERT_EQ(json["parts"].size(), 9U);
  EXPECT_EQ(json["parts"][0].dump(),
            R"({"part":"top left","corners":0,"corners_wanted":30,"corners_in_picture":5})");
  EXPECT_EQ(json["parts"][8]["part"], "bottom right");
  EXPECT_EQ(json["parts"][8]["corners"], 19);
  ASSERT_EQ(json["tilts"].size(), 4U);
  EXPECT_EQ(json["tilts"][0].dump(), R"({"nearer_edge":"left","views":1,"views_wanted":2})");
  EXPECT_EQ(json["tilts"][3]["nearer_edge"], "lower");
  EXPECT_EQ(json["missing"].size(), 3U);
  EXPECT_EQ(json["good_enough"], false);
}

TEST(GuidedCalibration, JsonHasNoFiguresBeforeTheFirstFit) {
  const auto json = to_json(GuideStatus(), GuideOptions());
  EXPECT_FALSE(json.contains("focal_sigma_share"));
  EXPECT_FALSE(json.contains("held_out_rms_px"));
}

}  // namespace
}  // namespace waymark
