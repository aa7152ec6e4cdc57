#include "waymark/plot/sheet_marks.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "waymark/plot/render.hpp"
#include "waymark/plot/text.hpp"

namespace waymark::plot {
namespace {

constexpr double kLongestRulerMm = 100.0;
constexpr double kRulerHeightMm = 4.5;
constexpr double kHairlineMm = 0.15;

void line(Point from, Point to, double width_mm, std::vector<Shape>& shapes) {
  shapes.emplace_back(Stroke{{from, to}, width_mm, kMarkColor, {}});
}

/// A tip at `x_mm` that points away from `x_mm + length_mm`.
void tip(double x_mm, double y_mm, double length_mm, std::vector<Shape>& shapes) {
  const double half_mm = std::abs(length_mm) / 3.5;
  shapes.emplace_back(Fill{
      {{{x_mm, y_mm}, {x_mm + length_mm, y_mm - half_mm}, {x_mm + length_mm, y_mm + half_mm}}}, kMarkColor});
}

}  // namespace

std::string millimetres(double length_mm) {
  return short_number(std::round(length_mm * 100.0) / 100.0) + " mm";
}

Footer place_footer(const Paper& paper, double margin_mm) {
  Footer footer;
  footer.strip = {margin_mm, paper.height_mm - margin_mm - kFooterHeightMm, paper.width_mm - 2 * margin_mm,
                  kFooterHeightMm};
  constexpr double kStepMm = 10.0;
  // Half a hairline of the end ticks lies outside the length they mark.
  const double room_mm = footer.strip.width_mm - kHairlineMm;
  const double length_mm = std::min(kLongestRulerMm, std::floor(room_mm / kStepMm) * kStepMm);
  footer.ruler = {paper.width_mm / 2 - length_mm / 2, footer.strip.y_mm + 1.5, length_mm, kRulerHeightMm};
  return footer;
}

void draw_footer(const Footer& footer, const std::string& remark, std::vector<Shape>& shapes) {
  const Box& ruler = footer.ruler;
  shapes.emplace_back(Group{"ruler"});
  // A bar of alternating black and white centimetres between its two ends.
  for (double at_mm = 0.0; at_mm < ruler.width_mm - kToleranceMm; at_mm += 20.0) {
    const double length_mm = std::min(10.0, ruler.width_mm - at_mm);
    shapes.emplace_back(filled({ruler.x_mm + at_mm, ruler.y_mm + 1.5, length_mm, 1.5}));
  }
  const double top_mm = ruler.y_mm + 1.5;
  const double bottom_mm = ruler.y_mm + 3.0;
  line({ruler.x_mm, top_mm}, {ruler.right_mm(), top_mm}, kHairlineMm, shapes);
  line({ruler.x_mm, bottom_mm}, {ruler.right_mm(), bottom_mm}, kHairlineMm, shapes);
  for (const double x_mm : {ruler.x_mm, ruler.right_mm()}) {
    line({x_mm, ruler.y_mm}, {x_mm, ruler.bottom_mm()}, kHairlineMm, shapes);
  }

  shapes.emplace_back(Group{"how-to-print"});
  const std::string how = fmt::format("Print at 100 %, no \u201cfit to page\u201d; this bar must measure {}.",
                                      millimetres(ruler.width_mm));
  const double middle_mm = footer.strip.middle_x_mm();
  const double room_mm = footer.strip.width_mm;
  shapes.emplace_back(
      Text{how, {middle_mm, ruler.bottom_mm() + 3.6}, 3.2, room_mm, Align::Middle, true, false, kMarkColor});
  shapes.emplace_back(Text{
      remark, {middle_mm, ruler.bottom_mm() + 7.6}, 2.8, room_mm, Align::Middle, false, false, kFaintColor});
}

void draw_dimension(double from_mm, double to_mm, const Box& strip, const std::string& words,
                    std::vector<Shape>& shapes) {
  const double y_mm = strip.middle_y_mm();
  const double length_mm = to_mm - from_mm;
  const double tip_mm = std::min({2.5, strip.height_mm * 0.6, length_mm / 6});
  const double height_mm = strip.height_mm * 0.8;
  const double wanted_mm = text_length_mm(words, height_mm, false);
  const double inside_mm = length_mm - 3 * tip_mm;
  const double beside_mm = strip.right_mm() - to_mm - 1.0;
  const bool beside = wanted_mm > inside_mm && beside_mm >= wanted_mm;
  const double words_mm = beside ? 0.0 : std::min(wanted_mm, inside_mm);
  const double gap_mm = beside ? 0.0 : words_mm + tip_mm / 2;
  const double middle_mm = (from_mm + to_mm) / 2;
  for (const double x_mm : {from_mm, to_mm})
    line({x_mm, strip.y_mm}, {x_mm, strip.bottom_mm()}, kHairlineMm, shapes);
  line({from_mm + tip_mm / 2, y_mm}, {middle_mm - gap_mm / 2, y_mm}, kHairlineMm, shapes);
  line({middle_mm + gap_mm / 2, y_mm}, {to_mm - tip_mm / 2, y_mm}, kHairlineMm, shapes);
  tip(from_mm, y_mm, tip_mm, shapes);
  tip(to_mm, y_mm, -tip_mm, shapes);
  const Point baseline{beside ? to_mm + 1.0 : middle_mm, y_mm + height_mm * 0.36};
  shapes.emplace_back(Text{words, baseline, height_mm, beside ? beside_mm : words_mm,
                           beside ? Align::Left : Align::Middle, false, false, kMarkColor});
}

void draw_up_mark(const Box& box, std::vector<Shape>& shapes) {
  shapes.emplace_back(
      Fill{{{{box.middle_x_mm(), box.y_mm}, {box.right_mm(), box.bottom_mm()}, {box.x_mm, box.bottom_mm()}}},
           kMarkColor});
}

}  // namespace waymark::plot
