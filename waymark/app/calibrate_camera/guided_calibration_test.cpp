// Guided calibration with a board in front of a camera: status as text and JSON, selected and missing views,
// and resuming.
#include "waymark/app/calibrate_camera/guided_calibration.hpp"

#include <cmath>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/golden_page.hpp"
#include "tests/support/recorded_lap.hpp"
#include "waymark/app/calibrate_camera/calibrate_camera.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/simulation/render/photograph.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/// Seven views, where one tilt to the left is missing and two parts of the image have too few corners.
GuideStatus some_views(const GuideOptions& options) {
  GuideStatus status{.wanted = options};
  status.image = CaptureVerdict::Moving;
  status.coverage = {.views = 7, .corners = {0, 40, 40, 40, 40, 40, 40, 40, 19}, .tilts = {1, 1, 2, 2, 2}};
  status.in_image = {5, 1, 0, 0, 0, 0, 0, 0, 0};
  status.missing = missing_views(status.coverage, options.coverage);
  status.held_out_rms_px = 0.21;
  status.focal_share = 0.003;
  return status;
}

TEST(GuidedCalibration, ALineNamesTheTiltsAndThePartsThatAreMissing) {
  const std::string text = to_text(some_views({}));
  EXPECT_THAT(text, AllOf(HasSubstr("7 views"), HasSubstr("0.21 px"), HasSubstr("0.3 %")));
  EXPECT_THAT(text,
              AllOf(HasSubstr("hold still"), HasSubstr("left edge"), HasSubstr("top left, bottom right")));
  testing::expect_on_page("calibrate", text);
}

TEST(GuidedCalibration, BeforeTheFirstViewTheTextNamesAllTiltsAndParts) {
  GuideStatus status;
  status.missing = missing_views(status.coverage, {});
  EXPECT_THAT(to_text(status), AllOf(HasSubstr("left, right, upper or lower edge"),
                                     HasSubstr("top left, top, top right"), Not(HasSubstr("px"))));
}

TEST(GuidedCalibration, JsonHasEveryPartAndTiltWithItsTarget) {
  GuideOptions options;
  options.coverage.corners_each_part = 30;
  const auto json = to_json(fields(some_views(options)));
  EXPECT_EQ(json["image"], "hold still");
  EXPECT_EQ(json["views"], 7);
  EXPECT_EQ(json["views_wanted"], 12);
  EXPECT_EQ(json["focal_sigma_share"], 0.003);
  EXPECT_EQ(json["focal_sigma_share_wanted"], 0.001);
  ASSERT_EQ(json["parts"].size(), 9U);
  EXPECT_EQ(json["parts"][0].dump(),
            R"({"part":"top left","corners":0,"corners_wanted":30,"corners_in_image":5})");
  EXPECT_EQ(json["parts"][8]["part"], "bottom right");
  EXPECT_EQ(json["parts"][8]["corners"], 19);
  ASSERT_EQ(json["tilts"].size(), 4U);
  EXPECT_EQ(json["tilts"][0].dump(), R"({"nearer_edge":"left","views":1,"views_wanted":2})");
  EXPECT_EQ(json["tilts"][3]["nearer_edge"], "lower");
  EXPECT_EQ(json["missing"].size(), 3U);
  EXPECT_EQ(json["good_enough"], false);
}

TEST(GuidedCalibration, JsonHasNoAccuracyBeforeTheFirstFit) {
  const auto json = to_json(fields(GuideStatus()));
  EXPECT_FALSE(json.contains("focal_sigma_share"));
  EXPECT_FALSE(json.contains("held_out_rms_px"));
}

/// A camera, a board of tags in front of it, and the inputs for a guided calibration.
struct Guide {
  CameraFitJob fit{.lens = "none"};
  CalibrationTarget target = CalibrationTarget::make({.columns = 5, .rows = 4, .tag_size_m = 0.04}).value();
  TagFinder finder = std::move(make_tag_finder().value());
  GuideOptions options{};
  CameraModel camera =
      CameraModel::make(PinholeRadtan{.fx = 512, .fy = 509, .cx = 326, .cy = 236}, 640, 480).value();
  Random random{20261125};
  int images = 0;

  /// An image of the board at a stop.
  Image image_at(double stop, double aside_m = 0) {
    const SO3 tilt = SO3::exp({to_radians(30) * std::cos(2.0 * stop), to_radians(30) * std::sin(2.0 * stop),
                               0.15 * std::sin(stop)});
    const SE3 cam_T_board(
        tilt, {aside_m + 0.05 * std::sin(1.7 * stop), 0.04 * std::cos(2.3 * stop), 0.42 + 0.02 * stop});
    PhotographScene scene;
    for (const auto& [id, tag] : target.tags().tags)
      scene.tags.push_back(
          {.tag = id, .cam_T_tag = cam_T_board * tag.map_T_tag, .size_m = tag.size_m, .margin_cells = 0.5});
    return photograph(camera, scene, {}, random).value().image;
  }
  SensorTime next() { return SensorTime(std::chrono::milliseconds(33 * images++)); }
  /// Repeats an image until the board counts as being at rest, and returns whether it became a view.
  bool hold(GuidedCalibration& guided, const Image& image) {
    bool taken = false;
    for (int i = 0; i < 3; ++i) {
      const auto now = guided.take(next(), image.view());
      EXPECT_TRUE(now) << to_string(now.error());
      taken = taken || (now && *now);
    }
    return taken;
  }
};

TEST(GuidedViews, TakesEachViewOnceStoresItAndResumesFromTheFolder) {
  Guide guide;
  const fs::path folder = testing::fresh_folder("jobs_guided") / "views";
  GuidedCalibration guided(guide.fit, guide.target, guide.finder, guide.options, folder.string());
  EXPECT_THAT(guided.status().missing, Not(IsEmpty())) << "views are missing before the first image";
  for (int stop = 0; stop < 4; ++stop) {
    const Image image = guide.image_at(stop);
    EXPECT_TRUE(guide.hold(guided, image)) << stop;
    EXPECT_FALSE(*guided.take(guide.next(), image.view())) << "a duplicate view is not added";
    EXPECT_EQ(guided.status().image, CaptureVerdict::Known);
    EXPECT_EQ(guided.status().coverage.views, static_cast<std::size_t>(stop + 1));
    EXPECT_EQ(guided.status().held_out_rms_px.has_value(), stop == 3) << "the first fit has four views";
  }
  EXPECT_EQ(guided.marks().size(), 20U);
  EXPECT_EQ(test::names_in(folder).size(), 4U);
  EXPECT_THAT(test::names_in(folder), ::testing::Contains("view-001.png"));
  const auto found = guided.finish();
  ASSERT_TRUE(found) << to_string(found.error());
  EXPECT_NEAR(found->found.parameters[0], 512, 5);
  EXPECT_EQ(found->mark_kind, "tags");
  EXPECT_THAT(to_text(*found), HasSubstr("fx_px"));

  std::ofstream(folder / "broken.png") << "no image";
  std::vector<std::string> notes;
  JobControl control;
  control.note = [&](const std::string& note) { notes.push_back(note); };
  GuidedCalibration again(guide.fit, guide.target, guide.finder, guide.options, folder.string());
  const auto resumed = again.resume(control);
  ASSERT_TRUE(resumed) << to_string(resumed.error());
  EXPECT_EQ(*resumed, 4U);
  EXPECT_EQ(notes.size(), 1U) << "there is a note on the broken image";
  EXPECT_NEAR(*again.status().focal_share, *guided.status().focal_share, 0.1 * *guided.status().focal_share);
  EXPECT_FALSE(guide.hold(again, guide.image_at(2))) << "a duplicate view is not added";
  EXPECT_TRUE(guide.hold(again, guide.image_at(0, 0.11)));
  EXPECT_TRUE(fs::exists(folder / "view-005.png")) << "existing files are not overwritten";
}

TEST(GuidedViews, RejectsImagesOfAnotherSize) {
  Guide guide;
  GuidedCalibration guided(guide.fit, guide.target, guide.finder, guide.options, "");
  ASSERT_TRUE(guide.hold(guided, guide.image_at(0)));
  guide.camera =
      CameraModel::make(PinholeRadtan{.fx = 512, .fy = 509, .cx = 300, .cy = 236}, 600, 480).value();
  const Image other = guide.image_at(3);
  Result<bool> last = false;
  for (int i = 0; i < 3 && last; ++i) last = guided.take(guide.next(), other.view());
  ASSERT_FALSE(last);
  EXPECT_EQ(last.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(to_string(last.error()), AllOf(HasSubstr("600 x 480 pixels"), HasSubstr("640 x 480")));
}

TEST(GuidedViews, EndsAtTheMaximumNumberOfViews) {
  Guide guide;
  guide.options.views_at_most = 2;
  GuidedCalibration guided(guide.fit, guide.target, guide.finder, guide.options, "");
  ASSERT_TRUE(guide.hold(guided, guide.image_at(0)));
  EXPECT_FALSE(guided.status().good_enough);
  ASSERT_TRUE(guide.hold(guided, guide.image_at(1)));
  EXPECT_TRUE(guided.status().good_enough);
  EXPECT_THAT(to_text(guided.status()), HasSubstr("good enough"));
  EXPECT_FALSE(guided.finish()) << "two views do not determine a camera";
}

TEST(GuidedViews, AMissingTargetIsReportedAfterSeconds) {
  Guide guide;
  GuidedCalibration guided(guide.fit, guide.target, guide.finder, guide.options, "");
  const Image wall(640, 480, 128);
  for (const int ms : {0, 1000, 2900}) {
    ASSERT_TRUE(guided.take(SensorTime(std::chrono::milliseconds(ms)), wall.view()));
    EXPECT_THAT(guided.status().absence, IsEmpty()) << ms;
  }
  ASSERT_TRUE(guided.take(SensorTime(std::chrono::milliseconds(3100)), wall.view()));
  EXPECT_THAT(guided.status().absence, Not(IsEmpty()));
  EXPECT_THAT(to_text(guided.status()), HasSubstr(guided.status().absence));
  const auto none = guided.finish();
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::NotFound);
  EXPECT_EQ(none.error().hint, guided.status().absence);
}

TEST(GuidedViews, FailsIfTheFolderCannotBeCreated) {
  Guide guide;
  const fs::path file = testing::fresh_folder("jobs_guided_file") / "file";
  std::ofstream(file) << "a file";
  GuidedCalibration guided(guide.fit, guide.target, guide.finder, guide.options, (file / "views").string());
  const Image image = guide.image_at(0);
  Result<bool> last = false;
  for (int i = 0; i < 3 && last; ++i) last = guided.take(guide.next(), image.view());
  ASSERT_FALSE(last);
  EXPECT_EQ(last.error().code, ErrorCode::Unwritable);
  EXPECT_EQ(last.error().place.source, (file / "views").string());
  EXPECT_EQ(*GuidedCalibration(guide.fit, guide.target, guide.finder, guide.options, "/nowhere").resume({}),
            0U);
}

}  // namespace
}  // namespace waymark
