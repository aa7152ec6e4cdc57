// A camera calibrated on a rendered video of a board: stops and moves between them.
#include <cmath>
#include <filesystem>
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/app/calibrate_camera/calibrate_camera.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/media/video_writer.hpp"
#include "waymark/simulation/photograph.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {
namespace {

constexpr int kStops = 9;
constexpr int kPicturesAStop = 3;

/// Where the board is at a stop, and on the way to the next.
SE3 cam_T_board_at(double stop) {
  const SO3 tilt = SO3::exp(
      {to_radians(30) * std::cos(2.0 * stop), to_radians(30) * std::sin(2.0 * stop), 0.15 * std::sin(stop)});
  return {tilt, {0.05 * std::sin(1.7 * stop), 0.04 * std::cos(2.3 * stop), 0.42 + 0.02 * stop}};
}

TEST(CalibrateVideo, TheStopsAreTakenAndGiveTheFocalLength) {
  const CameraModel truth =
      CameraModel::make(PinholeRadtan{.fx = 512, .fy = 509, .cx = 326, .cy = 236}, 640, 480).value();
  const std::filesystem::path folder = testing::fresh_folder("jobs_calibrate_video");
  CalibrateCameraJob job{.target = {.columns = 5, .rows = 4, .tag_size_m = 0.04}, .lens = "none"};
  const CalibrationTarget target = CalibrationTarget::make(job.target).value();
  auto writer = VideoWriter::create(folder / "board.mp4", 640, 480, {.quality = 12});
  if (!writer && writer.error().code == ErrorCode::Unsupported) GTEST_SKIP() << to_string(writer.error());
  ASSERT_TRUE(writer) << to_string(writer.error());
  Random random(20261123);
  int k = 0;
  const auto show = [&](double stop) {
    PhotographScene scene;
    for (const auto& [id, tag] : target.tags().tags)
      scene.tags.push_back({.tag = id,
                            .cam_T_tag = cam_T_board_at(stop) * tag.map_T_tag,
                            .size_m = tag.size_m,
                            .margin_cells = 0.5});
    const auto picture = photograph(truth, scene, {}, random);
    ASSERT_TRUE(picture) << to_string(picture.error());
    ASSERT_TRUE(writer->add(picture->image.view(), SensorTime(std::chrono::milliseconds(33 * k++))));
  };
  for (int stop = 0; stop < kStops; ++stop) {
    for (int i = 0; i < kPicturesAStop; ++i) show(stop);
    show(stop + 0.5);  // on the way: too fast
  }
  ASSERT_TRUE(writer->close());
  job.sources = {(folder / "board.mp4").string()};
  std::vector<std::string> notes;
  JobControl control;
  control.note = [&](const std::string& words) { notes.push_back(words); };
  const TagFinder finder = std::move(make_tag_finder().value());
  const auto report = calibrate_camera(job, target, finder, control);
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_THAT(notes, ::testing::Contains(::testing::HasSubstr("of 36 pictures stand still")));
  EXPECT_GE(report->pictures.size(), 6U);
  std::set<int> stops;  // some look alike
  for (const std::string& name : report->pictures) {
    const int index = static_cast<int>(std::lround(std::stod(name.substr(name.rfind('#') + 1)) / 0.033));
    EXPECT_LT(index % (kPicturesAStop + 1), kPicturesAStop) << "taken on the way: " << name;
    EXPECT_TRUE(stops.insert(index / (kPicturesAStop + 1)).second) << "taken twice: " << name;
  }
  ASSERT_EQ(report->found.names[0], "fx_px");
  EXPECT_NEAR(report->found.parameters[0], 512, 2.5);
  EXPECT_LT(std::abs(report->found.parameters[0] - 512), 5 * sigma_of(report->found, 0));
}

}  // namespace
}  // namespace waymark
