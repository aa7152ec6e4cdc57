#include "waymark/plot/page.hpp"

#include <gmock/gmock.h>

#include "tests/support/golden_page.hpp"

namespace waymark::plot {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

Page page_of_one() {
  return {.title = "A & B",
          .subtitle = "<today>",
          .sections = {{.title = "Map",
                        .words = {"One \"word\"."},
                        .tables = {{.caption = "tags", .head = {"tag", "x [m]"}, .rows = {{"1", "2.0"}}}},
                        .figures = {{.name = "line",
                                     .figure = {.title = "a line", .series = {{.x = {0, 1}, .y = {0, 1}}}},
                                     .caption = "rises"}}}}};
}

TEST(Page, IsSelfContainedAndEscapesText) {
  const std::string html = to_html(page_of_one()).value();
  EXPECT_THAT(html, HasSubstr("<h1>A &amp; B</h1>"));
  EXPECT_THAT(html, HasSubstr("&lt;today&gt;"));
  EXPECT_THAT(html, HasSubstr("<p>One &quot;word&quot;.</p>"));
  EXPECT_THAT(html, HasSubstr("<td>2.0</td>"));
  EXPECT_THAT(html, HasSubstr("<svg role=\"img\" xmlns="));
  EXPECT_THAT(html, HasSubstr("<figcaption>rises</figcaption>"));
  for (const char* outside : {"<script", "src=", "<link", "@import", "url(", "<?xml"})
    EXPECT_THAT(html, Not(HasSubstr(outside)));
  EXPECT_EQ(html, to_html(page_of_one()).value());
}

TEST(Page, TheErrorNamesTheFigure) {
  Page page = page_of_one();
  page.sections[0].figures[0].figure.series.clear();
  const auto html = to_html(page);
  ASSERT_FALSE(html);
  EXPECT_THAT(html.error().message, HasSubstr("'line'"));
  testing::expect_on_page("plot", html.error());
}

}  // namespace
}  // namespace waymark::plot
