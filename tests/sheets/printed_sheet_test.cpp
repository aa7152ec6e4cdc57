// Printed sheets, measured: PDF, SVG and PNG files rasterised by independent programs.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <regex>
#include <set>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "tests/sheets/tag_finder.hpp"
#include "tests/support/raster.hpp"
#include "waymark/plot/render.hpp"
#include "waymark/plot/tag_sheet.hpp"

namespace waymark::plot {
namespace {

using waymark::testing::edge_mm;
using waymark::testing::Raster;

constexpr double kToleratedMm = 0.05;

struct Case {
  FamilyId family;
  const char* paper;
  double share;  ///< of the largest size that fits
  double dpi;
};

std::string name_of(const ::testing::TestParamInfo<Case>& info) {
  return std::string(to_string(info.param.family)) + "_" + info.param.paper + "_" +
         std::to_string(static_cast<int>(info.param.dpi)) + "dpi_" +
         std::to_string(static_cast<int>(std::lround(info.param.share * 100)));
}

/// Usually each family and each paper once; with WAYMARK_FULL all pairs, large and small.
std::vector<Case> cases() {
  const std::vector<const char*> papers = {"A4", "A3", "A5", "Letter", "Legal"};
  std::vector<Case> all;
  for (std::size_t i = 0; i < kAllFamilies.size(); ++i) {
    all.push_back({kAllFamilies.at(i), papers.at(i % papers.size()), i % 2 == 0 ? 1.0 : 0.45, 300});
  }
  all.push_back({FamilyId::Tag36h11, "A5", 0.1, 600});
  if (std::getenv("WAYMARK_FULL") == nullptr) return all;
  for (const FamilyId family : kAllFamilies) {
    for (const char* paper : papers) {
      all.push_back({family, paper, 0.98, 300});
      all.push_back({family, paper, 0.13, 600});
    }
  }
  return all;
}

SheetLayout sheet_of(const Case& wanted) {
  SheetOptions options;
  options.paper = parse_paper(wanted.paper).value();
  options.tag_size_m = largest_tag_size_m(wanted.family, options).value_or(0.0) * wanted.share;
  return layout_sheet(wanted.family, {0, 3, 7, 11, 12, 29}, options).value();
}

/// The measured border of a tag on the page: left, right, top, bottom in mm.
std::array<double, 4> measured_border(const Raster& page, const PlacedTag& placed) {
  const Box& square = placed.square;
  const double cell_mm = square.width_mm / family(placed.tag.family).width_at_border;
  const double half_mm = cell_mm / 2;
  const auto edge = [&](bool along_x, double at_mm) {
    const double band_mm = along_x ? square.y_mm : square.x_mm;
    return edge_mm(page, along_x, at_mm - half_mm, at_mm + half_mm, band_mm + cell_mm,
                   band_mm + square.width_mm - cell_mm);
  };
  return {edge(true, square.x_mm), edge(true, square.right_mm()), edge(false, square.y_mm),
          edge(false, square.bottom_mm())};
}

void expect_true_to_scale(const Raster& page, const std::vector<PlacedTag>& tags, double tag_size_mm) {
  for (const PlacedTag& placed : tags) {
    const auto border = measured_border(page, placed);
    const Box& square = placed.square;
    const std::array<double, 4> wanted = {square.x_mm, square.right_mm(), square.y_mm, square.bottom_mm()};
    for (std::size_t i = 0; i < 4; ++i)
      EXPECT_NEAR(border.at(i), wanted.at(i), kToleratedMm) << to_string(placed.tag) << " edge " << i;
    EXPECT_NEAR(border[1] - border[0], tag_size_mm, kToleratedMm) << to_string(placed.tag);
    EXPECT_NEAR(border[3] - border[2], tag_size_mm, kToleratedMm) << to_string(placed.tag);
  }
}

/// AprilTag 3 detects each tag, upright, at the position in the layout. Its corners may have an error of a
/// third of a pixel, which is the accuracy of the detector; the edges above have the tolerance of the sheet.
void expect_readable(const Raster& page, const std::vector<PlacedTag>& tags) {
  const auto seen = waymark::testing::find_tags(page, tags.front().tag.family);
  ASSERT_EQ(seen.size(), tags.size());
  for (std::size_t i = 0; i < tags.size(); ++i) {
    EXPECT_EQ(seen[i].tag, tags[i].tag);
    const Box& square = tags[i].square;
    const std::array<Point, 4> corners = {{{square.x_mm, square.y_mm},
                                           {square.right_mm(), square.y_mm},
                                           {square.right_mm(), square.bottom_mm()},
                                           {square.x_mm, square.bottom_mm()}}};
    const double tolerated_mm = kToleratedMm + 0.35 / page.px_per_mm();
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_NEAR(seen[i].corners_mm.at(k).x_mm, corners.at(k).x_mm, tolerated_mm);
      EXPECT_NEAR(seen[i].corners_mm.at(k).y_mm, corners.at(k).y_mm, tolerated_mm);
    }
  }
}

class PrintedSheet : public ::testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Every, PrintedSheet, ::testing::ValuesIn(cases()), name_of);

TEST_P(PrintedSheet, IsTrueToScaleAndReadable) {
  const SheetLayout layout = sheet_of(GetParam());
  const Bytes pdf = render_pdf(draw_sheet(layout)).value();
  const Raster page = waymark::testing::rasterise_pdf(pdf, 1, GetParam().dpi);
  ASSERT_FALSE(page.empty());
  EXPECT_NEAR(page.width, layout.paper.width_mm * page.px_per_mm(), 1.0);
  EXPECT_NEAR(page.height, layout.paper.height_mm * page.px_per_mm(), 1.0);
  expect_true_to_scale(page, layout.pages.front(), layout.tag_size_mm);
  expect_readable(page, layout.pages.front());
}

SheetLayout small_sheet(FamilyId family = FamilyId::Tag36h11, const char* paper = "A5",
                        double tag_size_m = 0.03) {
  SheetOptions options;
  options.paper = parse_paper(paper).value();
  options.tag_size_m = tag_size_m;
  return layout_sheet(family, {0, 3, 7, 11}, options).value();
}

class EachFamilySheet : public ::testing::TestWithParam<FamilyId> {};
INSTANTIATE_TEST_SUITE_P(All, EachFamilySheet, ::testing::ValuesIn(kAllFamilies),
                         [](const auto& family) { return std::string(to_string(family.param)); });

TEST_P(EachFamilySheet, SvgIsTrueToScaleAndReadable) {
  const SheetLayout layout = small_sheet(GetParam());
  const Raster page = waymark::testing::rasterise_svg(render_svg(draw_sheet(layout).front()).value(), 200);
  ASSERT_FALSE(page.empty());
  EXPECT_NEAR(page.width, layout.paper.width_mm * page.px_per_mm(), 1.0);
  expect_true_to_scale(page, layout.pages.front(), layout.tag_size_mm);
  expect_readable(page, layout.pages.front());
}

TEST_P(EachFamilySheet, PngRecordsItsResolutionAndIsTrueToIt) {
  const SheetLayout layout = small_sheet(GetParam());
  const Raster page = waymark::testing::read_png(render_png(draw_sheet(layout).front(), 254).value());
  ASSERT_FALSE(page.empty());
  EXPECT_DOUBLE_EQ(page.dpi, 254.0);
  EXPECT_EQ(page.width, 10 * layout.paper.width_mm);
  EXPECT_EQ(page.height, 10 * layout.paper.height_mm);
  expect_true_to_scale(page, layout.pages.front(), layout.tag_size_mm);
  expect_readable(page, layout.pages.front());
}

bool within(const Box& box, double x_mm, double y_mm, double slack_mm) {
  return x_mm >= box.x_mm - slack_mm && x_mm <= box.right_mm() + slack_mm && y_mm >= box.y_mm - slack_mm &&
         y_mm <= box.bottom_mm() + slack_mm;
}

bool on_outline(const Box& box, double x_mm, double y_mm, double slack_mm) {
  const Box inner{box.x_mm + slack_mm, box.y_mm + slack_mm, box.width_mm - 2 * slack_mm,
                  box.height_mm - 2 * slack_mm};
  return within(box, x_mm, y_mm, slack_mm) && !within(inner, x_mm, y_mm, 0.0);
}

/// The tests of the layout check planned positions; this one checks that nothing is drawn elsewhere.
TEST_P(EachFamilySheet, EveryMarkIsAtItsPlannedPosition) {
  const SheetLayout layout = small_sheet(GetParam(), "A5", 0.012);
  const Raster page = waymark::testing::rasterise_pdf(render_pdf(draw_sheet(layout)).value(), 1, 150);
  const double slack_mm = 1.0 / page.px_per_mm();
  const bool white_ring = !family(GetParam()).reversed_border;
  int stray = 0;
  for (int y = 0; y < page.height; ++y) {
    for (int x = 0; x < page.width; ++x) {
      if (page.at(x, y) == 255) continue;
      const double x_mm = (x + 0.5) / page.px_per_mm();
      const double y_mm = (y + 0.5) / page.px_per_mm();
      const auto& tags = layout.pages.front();
      const bool planned = within(layout.footer.strip, x_mm, y_mm, 0.0) ||
                           std::any_of(tags.begin(), tags.end(), [&](const PlacedTag& placed) {
                             return within(white_ring ? placed.square : placed.cells, x_mm, y_mm, slack_mm) ||
                                    within(placed.caption, x_mm, y_mm, 0.0) ||
                                    on_outline(placed.tile, x_mm, y_mm, slack_mm);
                           });
      if (!planned) ++stray;
    }
  }
  EXPECT_EQ(stray, 0);
}

/// The fraction of ink in a box of the page.
double ink_in(const Raster& page, double x0_mm, double y0_mm, double x1_mm, double y1_mm) {
  const auto pixel = [&](double mm) { return static_cast<int>(std::lround(mm * page.px_per_mm())); };
  return page.ink(pixel(x0_mm), pixel(y0_mm), pixel(x1_mm), pixel(y1_mm));
}

TEST_P(EachFamilySheet, UpMarkPointsUp) {
  const SheetLayout layout = small_sheet(GetParam());
  const Raster page = waymark::testing::rasterise_pdf(render_pdf(draw_sheet(layout)).value(), 1, 300);
  const Box& mark = layout.pages.front().front().up_mark;
  const double upper = ink_in(page, mark.x_mm, mark.y_mm, mark.right_mm(), mark.middle_y_mm());
  const double lower = ink_in(page, mark.x_mm, mark.middle_y_mm(), mark.right_mm(), mark.bottom_mm());
  EXPECT_NEAR(upper, 0.25 * 0.75,
              0.05);  // a triangle, dark grey: a quarter of its upper half, three quarters of its lower
  EXPECT_NEAR(lower, 0.75 * 0.75, 0.05);
}

/// The middle of a thin dark line between two positions, in mm.
double line_mm(const Raster& page, double from_mm, double to_mm, double band0_mm, double band1_mm) {
  double weight = 0.0;
  double moment = 0.0;
  for (int x = static_cast<int>(from_mm * page.px_per_mm()); x < static_cast<int>(to_mm * page.px_per_mm());
       ++x) {
    const double ink = page.ink(x, static_cast<int>(std::lround(band0_mm * page.px_per_mm())), x + 1,
                                static_cast<int>(std::lround(band1_mm * page.px_per_mm())));
    weight += ink;
    moment += ink * (x + 0.5);
  }
  EXPECT_GT(weight, 0.3) << "no line between " << from_mm << " and " << to_mm;
  return moment / weight / page.px_per_mm();
}

TEST(PrintedRuler, HasThePrintedLength) {
  std::set<int> lengths;
  for (const char* paper : {"A4", "A3", "75x75", "60x60"}) {
    const SheetLayout layout = small_sheet(FamilyId::Tag36h11, paper, 0.015);
    const Box& ruler = layout.footer.ruler;
    const Bytes pdf = render_pdf(draw_sheet(layout)).value();
    const Raster page = waymark::testing::rasterise_pdf(pdf, 1, 600);
    const double left_mm = line_mm(page, ruler.x_mm - 1, ruler.x_mm + 1, ruler.y_mm + 0.2, ruler.y_mm + 1.2);
    const double right_mm =
        line_mm(page, ruler.right_mm() - 1, ruler.right_mm() + 1, ruler.y_mm + 0.2, ruler.y_mm + 1.2);
    const std::string text = waymark::testing::text_of_pdf(pdf);
    std::smatch claim;
    ASSERT_TRUE(std::regex_search(text, claim, std::regex("bar [a-z ]*([0-9]+) mm"))) << text;
    EXPECT_NEAR(right_mm - left_mm, std::stod(claim[1]), kToleratedMm) << paper;
    lengths.insert(std::stoi(claim[1]));
  }
  EXPECT_EQ(lengths, (std::set{40, 60, 100}));
}

TEST(PrintedText, ContainsTagSizeAndPrintScale) {
  const SheetLayout layout = small_sheet(FamilyId::TagStandard41h12);
  const std::string text = waymark::testing::text_of_pdf(render_pdf(draw_sheet(layout)).value());
  for (const char* words : {"tagStandard41h12:0", "tagStandard41h12:3", "30 mm", "100 %", "100 mm",
                            "tag_size_m 0.03", "A5", "1 of 1"}) {
    EXPECT_NE(text.find(words), std::string::npos) << words << " is not in:\n" << text;
  }
}

/// Adjacent cells are one area, so that no viewer shows a light line between them at any scale.
TEST(PrintedTag, HasNoSeams) {
  const SheetLayout layout = small_sheet(FamilyId::Tag36h11, "A5", 0.03);
  for (const double dpi : {71.3, 97.7, 133.1}) {
    const Raster page = waymark::testing::rasterise_pdf(render_pdf(draw_sheet(layout)).value(), 1, dpi);
    const Box& square = layout.pages.front().front().square;
    const double cell_mm = square.width_mm / 8;
    const double inset_mm = 1.5 / page.px_per_mm();  // away from the antialiased rim
    EXPECT_EQ(ink_in(page, square.x_mm + inset_mm, square.y_mm + inset_mm, square.right_mm() - inset_mm,
                     square.y_mm + cell_mm - inset_mm),
              1.0);
    EXPECT_EQ(ink_in(page, square.x_mm + inset_mm, square.y_mm + inset_mm, square.x_mm + cell_mm - inset_mm,
                     square.bottom_mm() - inset_mm),
              1.0);
  }
}

}  // namespace
}  // namespace waymark::plot
