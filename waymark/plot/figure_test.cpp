#include "waymark/plot/figure.hpp"

#include <cmath>
#include <limits>
#include <string>

#include <rapidcheck.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/plot/render.hpp"

namespace waymark::plot {
namespace {

using ::testing::HasSubstr;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(LinearTicks, AreRoundNumbersWithinTheLimits) {
  EXPECT_TRUE(rc::check([] {
    const double low = *rc::gen::inRange(-100000, 100000) * std::pow(10.0, *rc::gen::inRange(-8, 8));
    const double high = low + *rc::gen::inRange(1, 100000) * std::pow(10.0, *rc::gen::inRange(-8, 8));
    RC_PRE(high - low > 1e-6 * std::max(std::abs(low), std::abs(high)));
    const int wanted = *rc::gen::inRange(2, 20);
    const auto ticks = linear_ticks(low, high, wanted);
    RC_ASSERT(!ticks.empty());
    RC_ASSERT(static_cast<int>(ticks.size()) <= wanted + 1);
    const double slack = 1e-8 * (high - low);
    for (std::size_t i = 0; i < ticks.size(); ++i) {
      RC_ASSERT(ticks[i].value >= low - slack && ticks[i].value <= high + slack);
      if (i > 1) RC_ASSERT(std::abs(ticks[i].value - 2 * ticks[i - 1].value + ticks[i - 2].value) < slack);
    }
  }));
}

TEST(LinearTicks, ARangeBetweenTwoWideStepsHasTicks) {
  EXPECT_EQ(linear_ticks(4.1609e-4, 4.1609e-4 + 4.0001e-3, 2).size(),
            2U);  // there is no multiple of 5e-3 in this range
}

TEST(LinearTicks, AreLabelledWithTheDecimalsOfTheirStep) {
  using ::testing::ElementsAre;
  EXPECT_THAT(linear_ticks(0, 1, 5), ElementsAre(Tick{0.0, "0"}, Tick{0.2, "0.2"}, Tick{0.4, "0.4"},
                                                 Tick{3 * 0.2, "0.6"}, Tick{0.8, "0.8"}, Tick{1.0, "1.0"}));
  EXPECT_THAT(linear_ticks(-5, 12, 4),
              ElementsAre(Tick{-5.0, "-5"}, Tick{0.0, "0"}, Tick{5.0, "5"}, Tick{10.0, "10"}));
}

TEST(LogTicks, ArePowersOfTenAndTheirMultiples) {
  int labelled = 0;
  for (const Tick& tick : log_ticks(0.003, 200)) {
    EXPECT_GE(tick.value, 0.003);
    EXPECT_LE(tick.value, 200.0);
    const double exponent = std::log10(tick.value);
    if (tick.label.empty()) continue;
    ++labelled;
    EXPECT_NEAR(exponent, std::round(exponent), 1e-9);
    EXPECT_DOUBLE_EQ(std::stod(tick.label), tick.value);
  }
  EXPECT_EQ(labelled, 5);  // from 0.01 to 100
  EXPECT_THAT(log_ticks(3, 30), ::testing::Contains(Tick{5.0, "5"}));
}

TEST(ClippedLines, StayInTheBoxAndOnTheLine) {
  EXPECT_TRUE(rc::check([] {
    const Box box{10, 20, 30, 15};
    std::vector<Point> points;
    for (int i = *rc::gen::inRange(2, 12); i > 0; --i)
      points.push_back({*rc::gen::inRange(0, 60) * 1.0, *rc::gen::inRange(0, 60) * 1.0});
    double length_in_mm = 0.0;  // measured in small steps along the line
    constexpr int kSteps = 2000;
    for (std::size_t i = 1; i < points.size(); ++i) {
      const Point a = points[i - 1];
      const Point b = points[i];
      for (int k = 0; k < kSteps; ++k) {
        const double share = (k + 0.5) / kSteps;
        const Point at{a.x_mm + share * (b.x_mm - a.x_mm), a.y_mm + share * (b.y_mm - a.y_mm)};
        if (inside(at, box)) length_in_mm += std::hypot(b.x_mm - a.x_mm, b.y_mm - a.y_mm) / kSteps;
      }
    }
    double length_mm = 0.0;
    for (const auto& part : clipped_lines(points, box)) {
      for (std::size_t i = 0; i < part.size(); ++i) {
        const Box wider{box.x_mm - 1e-9, box.y_mm - 1e-9, box.width_mm + 2e-9, box.height_mm + 2e-9};
        RC_ASSERT(inside(part[i], wider));
        if (i > 0) length_mm += std::hypot(part[i].x_mm - part[i - 1].x_mm, part[i].y_mm - part[i - 1].y_mm);
      }
    }
    RC_ASSERT(std::abs(length_mm - length_in_mm) < 0.1 * static_cast<double>(points.size()));
  }));
}

TEST(ClippedLines, BreakWhereAPointIsMissing) {
  const auto parts =
      clipped_lines({{1, 1}, {2, 1}, {kNan, 1}, {3, 1}, {4, 1}, {kInfinity, 0}, {5, 5}}, {0, 0, 10, 10});
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_EQ(parts[0].back(), (Point{2, 1}));
  EXPECT_EQ(parts[1].front(), (Point{3, 1}));
}

TEST(ClippedLines, OmitInvisiblePoints) {
  std::vector<Point> points;
  for (int i = 0; i <= 100000; ++i) points.push_back({i * 1e-4, 5});
  const auto parts = clipped_lines(points, {0, 0, 10, 10});
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_LT(parts[0].size(), 600U);
  EXPECT_EQ(parts[0].front(), points.front());
  EXPECT_EQ(parts[0].back(), points.back());
}

Figure small_figure() {
  Figure figure;
  figure.title = "Error & drift";
  figure.x = {"time", "s"};
  figure.y = {"error", "m"};
  figure.series = {{"mine", {0, 1, 2}, {0.0, 0.5, 0.1}},
                   {"theirs", {0, 1, 2}, {0.2, kNan, 0.4}, Series::Style::LineAndPoints}};
  return figure;
}

std::string svg_of(const Figure& figure) {
  const Bytes bytes = render_svg(draw_figure(figure).value()).value();
  return {bytes.begin(), bytes.end()};
}

TEST(Figure, ShowsTitleUnitsAndLegend) {
  const std::string svg = svg_of(small_figure());
  for (const char* words :
       {"Error &amp; drift", "time [s]", "error [m]", "\"mine\"", "\"theirs\"", "aria-label=\"0.5\""}) {
    EXPECT_THAT(svg, HasSubstr(words));
  }
  EXPECT_THAT(svg, ::testing::Not(HasSubstr("nan")));
  EXPECT_THAT(svg, ::testing::Not(HasSubstr("inf")));
  EXPECT_EQ(svg_of(small_figure()), svg);
}

/// Everything stays on the page, except text, which the renderer shrinks to fit.
TEST(Figure, StaysOnThePageForAnyValues) {
  EXPECT_TRUE(rc::check([] {
    Figure figure;
    figure.x.label = figure.y.label = "value";
    figure.equal_scales = *rc::gen::arbitrary<bool>();
    figure.y.logarithmic = *rc::gen::arbitrary<bool>();
    for (int s = *rc::gen::inRange(1, 12); s > 0; --s) {
      Series series{
          "series",
          {},
          {},
          *rc::gen::element(Series::Style::Line, Series::Style::Points, Series::Style::LineAndPoints)};
      for (int i = *rc::gen::inRange(0, 20); i > 0; --i) {
        series.x.push_back(*rc::gen::element(0.0, 1.0, -3.5, 1e-12, 1e9, kNan, kInfinity));
        series.y.push_back(*rc::gen::element(0.0, 1.0, 2.5, -7.0, 1e-9, 1e6, kNan, -kInfinity));
      }
      figure.series.push_back(series);
    }
    const auto drawing = draw_figure(figure);
    if (!drawing) RC_DISCARD("nothing to draw");
    const Box page{0, 0, drawing->width_mm, drawing->height_mm};
    for (const Shape& shape : drawing->shapes) {
      if (const auto* stroke = std::get_if<Stroke>(&shape)) {
        for (const Point& point : stroke->points) RC_ASSERT(inside(point, page));
      }
      if (const auto* fill = std::get_if<Fill>(&shape)) {
        for (const Point& point : fill->loops.front()) RC_ASSERT(inside(point, page));
      }
      if (const auto* text = std::get_if<Text>(&shape)) RC_ASSERT(inside(text->baseline, page));
    }
    RC_ASSERT(render_png(*drawing, 30).has_value());
  }));
}

TEST(Figure, EqualScalesKeepACircleRound) {
  Figure figure;
  figure.equal_scales = true;
  Series circle{"circle", {}, {}};
  for (int i = 0; i <= 360; ++i) {
    circle.x.push_back(5 + 2 * std::cos(i * 0.0174532925));
    circle.y.push_back(2 * std::sin(i * 0.0174532925));
  }
  figure.series = {circle};
  const Drawing drawing = draw_figure(figure).value();
  double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
  bool in_circle = false;
  for (const Shape& shape : drawing.shapes) {
    if (const auto* group = std::get_if<Group>(&shape)) in_circle = group->name == "circle";
    const auto* stroke = std::get_if<Stroke>(&shape);
    if (!in_circle || stroke == nullptr) continue;
    for (const Point& point : stroke->points) {
      left = std::min(left, point.x_mm), right = std::max(right, point.x_mm);
      top = std::min(top, point.y_mm), bottom = std::max(bottom, point.y_mm);
    }
  }
  EXPECT_GT(right - left, 20.0);
  EXPECT_NEAR(right - left, bottom - top, 1e-6);
}

TEST(Figure, InvalidFiguresAreRejected) {
  const auto expect_error = [](const Figure& figure, const std::string& key, const char* value) {
    const auto drawing = draw_figure(figure);
    ASSERT_FALSE(drawing) << value;
    EXPECT_EQ(drawing.error().code, ErrorCode::InvalidArgument) << value;
    EXPECT_EQ(drawing.error().place.key, key);
    EXPECT_THAT(drawing.error().message, HasSubstr(value));
    testing::expect_on_page("plot", drawing.error());
  };
  expect_error({}, "x", "value");
  Figure figure = small_figure();
  figure.series[0].x.pop_back();
  expect_error(figure, "", "'mine' has 2 x values and 3 y values");
  figure = small_figure();
  figure.x.low = 3;
  figure.x.high = 2;
  expect_error(figure, "x", "3 to 2");
  figure = small_figure();
  figure.y.logarithmic = true;
  figure.y.low = 0;
  expect_error(figure, "y", "logarithmic");
  figure = small_figure();
  figure.y.high = kNan;
  expect_error(figure, "y", "finite");
  figure = small_figure();
  figure.y.high = -5;
  expect_error(figure, "y", "limits");
  figure = small_figure();
  figure.width_mm = 10;
  expect_error(figure, "", "10 x 100 mm");
  figure = small_figure();
  for (int i = 0; i < 200; ++i) figure.series.push_back({"another " + std::to_string(i), {0}, {0}});
  expect_error(figure, "", "legend");
}

}  // namespace
}  // namespace waymark::plot
