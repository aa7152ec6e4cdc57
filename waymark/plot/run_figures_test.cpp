#include "waymark/plot/run_figures.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <variant>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "waymark/geometry/planar.hpp"

namespace waymark::plot {
namespace {

Trajectory straight(double y_m, int shift_ms = 0) {
  Trajectory trajectory;
  for (int i = 0; i <= 100; ++i)
    trajectory.push_back(
        {SensorTime(std::chrono::milliseconds(100 * i + shift_ms)), lift(SE2(0.1 * i, y_m, 0))});
  return trajectory;
}

std::string style_sheet_color(const Color& color) {
  const auto byte = [](double value) { return std::lround(255 * value); };
  return fmt::format("#{:02x}{:02x}{:02x}", byte(color.red), byte(color.green), byte(color.blue));
}

/// The first block of the style sheet defines the light page.
TEST(RunColors, MatchTheViewer) {
  std::ifstream file(WAYMARK_SHARE "/../viewer/src/style.css");
  const std::string style(std::istreambuf_iterator<char>(file), {});
  const std::string light = style.substr(0, style.find('}'));
  constexpr std::pair<const char*, Color> kColors[] = {
      {"--truth", kTruthColor}, {"--odometry", kOdometryColor}, {"--estimate", kEstimateColor}};
  for (const auto& [name, color] : kColors)
    EXPECT_NE(light.find(fmt::format("{}: {};", name, style_sheet_color(color))), std::string::npos)
        << name << " should be " << style_sheet_color(color) << " in viewer/src/style.css";
}

TEST(LoopFigures, ErrorsMatchTheTrajectories) {
  // Half a step later on the same line, so the truth is interpolated between two poses.
  const Figure late = trajectory_error_figure("", straight(0.25, 50), straight(0));
  ASSERT_EQ(late.series.at(0).y.size(), 100U) << "the last pose is after the truth";
  for (const double error : late.series[0].y) EXPECT_NEAR(error, std::hypot(0.25, 0.05), 1e-12);
  const Figure beside = cross_track_figure("", straight(0.25), straight(0));
  for (const double error : beside.series.at(0).y) EXPECT_NEAR(error, 0.25, 1e-9);
  EXPECT_NEAR(beside.series[0].x.back(), 10.0, 1e-9);
}

TEST(LoopFigures, TagsPointTowardsTheirViewerAndAllAreDrawn) {
  TagMap tags;
  tags.tags[{}] = {.map_T_tag = SE3(SO3(), {1, 2, 0}), .size_m = 0.2};  // z up, so its viewer is below, at -z
  const Figure figure = path_figure("", {{"truth", straight(0), tags, kTruthColor}});
  ASSERT_EQ(figure.series.size(), 2U);
  EXPECT_EQ(figure.series[1].x.front(), 0.9);
  EXPECT_TRUE(figure.equal_scales);
  EXPECT_TRUE(draw_figure(figure));
  EXPECT_TRUE(draw_figure(tags_in_view_figure("", {TagFrame{}})));
}

TEST(LoopFigures, CoincidingLayersDifferAndEachIdIsShownOnce) {
  TagMap tags;
  tags.tags[TagId{.number = 7}] = {.map_T_tag = SE3(SO3(), {1, 2, 0}), .size_m = 0.2};
  const Figure figure = path_figure(
      "", {{"truth", straight(0), tags, kTruthColor}, {"estimate", straight(0), tags, kEstimateColor}});
  ASSERT_EQ(figure.series.size(), 4U);
  const Series &truth = figure.series[0], &estimate = figure.series[2];
  EXPECT_GT(truth.line->width_mm, estimate.line->width_mm) << "the lower layer is broader";
  EXPECT_NE(truth.line->dash_mm, estimate.line->dash_mm);
  ASSERT_EQ(figure.series[1].labels.size(), 1U);
  EXPECT_EQ(figure.series[1].labels[0].text, "7");
  EXPECT_TRUE(figure.series[3].labels.empty());
  const auto drawn = draw_figure(figure);
  ASSERT_TRUE(drawn);
  const auto words = std::ranges::count_if(drawn->shapes, [](const Shape& shape) {
    const auto* text = std::get_if<Text>(&shape);
    return text != nullptr && text->words == "7";
  });
  EXPECT_EQ(words, 1);
}

TEST(LoopFigures, EmptyFiguresFailToDraw) {
  EXPECT_FALSE(draw_figure(path_figure("", {})));
  EXPECT_FALSE(draw_figure(trajectory_error_figure("", {}, {})));
  EXPECT_FALSE(draw_figure(cross_track_figure("", {}, {})));
  EXPECT_FALSE(draw_figure(tags_in_view_figure("", {})));
}

}  // namespace
}  // namespace waymark::plot
