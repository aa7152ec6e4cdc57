#include "waymark/plot/render.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/plot/tag_sheet.hpp"
#include "waymark/plot/text.hpp"

namespace waymark::plot {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string as_text(const Bytes& bytes) { return {bytes.begin(), bytes.end()}; }

std::vector<Drawing> two_pages() {
  SheetOptions options;
  options.tag_size_m = 0.05;
  return draw_sheet(layout_sheet(FamilyId::Tag36h11, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9}, options).value());
}

TEST(Render, SameInputSameBytes) {
  const auto pages = two_pages();
  ASSERT_EQ(pages.size(), 2U);
  const Bytes pdf = render_pdf(pages).value();
  const Bytes svg = render_svg(pages[0]).value();
  const Bytes png = render_png(pages[0], 100).value();
  EXPECT_EQ(render_pdf(two_pages()).value(), pdf);
  EXPECT_EQ(render_svg(two_pages()[0]).value(), svg);
  EXPECT_EQ(render_png(two_pages()[0], 100).value(), png);
}

TEST(RenderPdf, HasNoDateAndDisablesPrintScaling) {
  const std::string pdf = as_text(render_pdf(two_pages()).value());
  EXPECT_THAT(pdf, Not(HasSubstr("CreationDate")));
  EXPECT_THAT(pdf, HasSubstr("/ViewerPreferences << /PrintScaling /None >>"));
  EXPECT_TRUE(pdf.ends_with("%%EOF\n"));
}

/// Every entry in the last cross-reference section points to its object.
TEST(RenderPdf, TheUpdateIsAtItsOffset) {
  const std::string pdf = as_text(render_pdf(two_pages()).value());
  const std::size_t section = std::stoul(pdf.substr(pdf.rfind("startxref") + 9));
  ASSERT_EQ(pdf.substr(section, 5), "xref\n");
  const std::size_t object = std::stoul(pdf.substr(section + 5));
  const std::size_t entry = pdf.find('\n', section + 5) + 1;
  const std::size_t offset = std::stoul(pdf.substr(entry, 10));
  EXPECT_TRUE(pdf.substr(offset).starts_with(std::to_string(object) + " 0 obj"));
  EXPECT_THAT(pdf.substr(section), HasSubstr("/Root " + std::to_string(object) + " 0 R"));
  EXPECT_THAT(pdf.substr(offset, section - offset), HasSubstr("/Type /Catalog"));
}

TEST(RenderSvg, KeepsMillimetresNamesAndText) {
  const std::string svg = as_text(render_svg(two_pages()[0]).value());
  EXPECT_THAT(svg, HasSubstr("width=\"210mm\" height=\"297mm\" viewBox=\"0 0 210 297\""));
  EXPECT_THAT(svg, HasSubstr("<g id=\"tag36h11:8\">"));
  EXPECT_THAT(svg, HasSubstr("aria-label=\"tag36h11:8\""));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

TEST(RenderSvg, EscapesText) {
  Drawing page{50, 50, "a < b & \"c\" \x01", {Group{"x\"y"}, Text{"<&>", {1, 10}}}};
  const std::string svg = as_text(render_svg(page).value());
  EXPECT_THAT(svg, HasSubstr("<title>a &lt; b &amp; &quot;c&quot;  </title>"));
  EXPECT_THAT(svg, HasSubstr("<g id=\"x&quot;y\">"));
  EXPECT_THAT(svg, HasSubstr("aria-label=\"&lt;&amp;&gt;\""));
}

TEST(Render, RejectsInvalidPages) {
  EXPECT_FALSE(render_pdf({}));
  for (const double bad : {0.0, -1.0, 5001.0, std::numeric_limits<double>::quiet_NaN()}) {
    const Drawing page{bad, 100, "", {}};
    EXPECT_FALSE(render_pdf({&page, 1}));
    EXPECT_FALSE(render_svg(page));
    EXPECT_FALSE(render_png(page, 100));
  }
  const Drawing page{100, 100, "", {}};
  for (const double dpi : {0.0, -1.0, 9.0, 2401.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(render_png(page, dpi).error().code, ErrorCode::InvalidArgument);
  }
  testing::expect_on_page("plot", render_png(page, 9).error());
  testing::expect_on_page("plot", render_svg({5001, 100, "", {}}).error());
  testing::expect_on_page("plot", render_png({841, 1189, "", {}}, 600).error());
  EXPECT_EQ(render_png({841, 1189, "", {}}, 600).error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(render_png({5000, 20, "", {}}, 300).error().code, ErrorCode::LimitExceeded);
}

TEST(RenderText, ShrinksToItsRoom) {
  const std::string words = "tagStandard41h12:2114";
  const double free_mm = text_length_mm(words, 3.0, true);
  EXPECT_NEAR(text_length_mm(words, 6.0, true), 2 * free_mm, 1e-3);
  EXPECT_GT(text_length_mm(words + words, 3.0, true), 1.9 * free_mm);
  EXPECT_EQ(text_length_mm("", 3.0, true), 0.0);
}

TEST(RenderText, OutlinesAreCompleteAtAnyPosition) {
  const auto parts = [](double x_mm, double y_mm) {
    const std::string outline =
        text_outline({.words = "How often does it end early?", .baseline = {x_mm, y_mm}});
    return std::ranges::count(outline, 'Z');
  };
  EXPECT_GE(parts(0, 0), 23);  // at least one loop per letter
  EXPECT_EQ(parts(200, 5), parts(0, 0));
  EXPECT_EQ(parts(150, 280), parts(0, 0));
}

TEST(FormatOf, DependsOnTheSuffix) {
  EXPECT_EQ(format_of("a.pdf").value(), FileFormat::Pdf);
  EXPECT_EQ(format_of("/x.y/a.SVG").value(), FileFormat::Svg);
  EXPECT_EQ(format_of("a.b.png").value(), FileFormat::Png);
  for (const char* path : {"", "a", "a.", ".hidden/a", "a.pdf.gz", "a.jpg", "pdf"}) {
    const auto format = format_of(path);
    ASSERT_FALSE(format) << path;
    EXPECT_EQ(format.error().code, ErrorCode::InvalidArgument) << path;
    EXPECT_THAT(format.error().hint, HasSubstr(".pdf, .svg or .png")) << path;
    testing::expect_on_page("plot", format.error());
  }
}

}  // namespace
}  // namespace waymark::plot
