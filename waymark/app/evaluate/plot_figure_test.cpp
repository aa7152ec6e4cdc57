// A single figure from a report, written to a separate file.
#include "waymark/app/evaluate/plot_figure.hpp"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/recorded_lap.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class PlotFigure : public ::testing::Test {
 protected:
  static const std::string& lap() {
    static const std::string file =
        test::record_lap(testing::fresh_folder("jobs_plot_lap") / "lap.mcap", 9, {.for_s = 4});
    return file;
  }
  [[nodiscard]] PlotJob job_of(const std::string& figure, const std::string& name = {}) const {
    return {.runs = {lap()}, .figure = figure, .output = name.empty() ? name : (folder_ / name).string()};
  }

  fs::path folder_ = testing::fresh_folder("jobs_plot");
};

TEST_F(PlotFigure, EveryListedFigureCanBeDrawn) {
  const auto list = plot_figure(job_of(""), {});
  ASSERT_TRUE(list) << to_string(list.error());
  EXPECT_EQ(list->written, "");
  ASSERT_FALSE(list->figures.empty());
  EXPECT_EQ(static_cast<std::size_t>(std::ranges::count(to_text(*list), '\n')), list->figures.size());
  for (const auto& [name, about] : list->figures) {
    EXPECT_THAT(to_text(*list), HasSubstr(name));
    const auto drawn = plot_figure(job_of(name, name + ".svg"), {});
    ASSERT_TRUE(drawn) << name << ": " << to_string(drawn.error());
    EXPECT_EQ(drawn->written, (folder_ / (name + ".svg")).string());
    EXPECT_THAT(test::file_text(drawn->written), HasSubstr("<svg"));
  }
}

TEST_F(PlotFigure, AnExistingFileIsReplacedOnlyWithForce) {
  const std::string name = plot_figure(job_of(""), {})->figures.front().first;
  PlotJob job = job_of(name, "figure.svg");
  ASSERT_TRUE(write_text_file(job.output, "mine"));
  const auto refused = plot_figure(job, {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::Unwritable);
  EXPECT_EQ(test::file_text(job.output), "mine");
  job.force = true;
  ASSERT_TRUE(plot_figure(job, {}));
  EXPECT_THAT(test::file_text(job.output), HasSubstr("<svg"));
}

TEST_F(PlotFigure, InvalidJobsAreReportedAndNothingIsWritten) {
  const std::string name = plot_figure(job_of(""), {})->figures.front().first;
  const auto unknown = plot_figure(job_of(name + "x", "figure.svg"), {});
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::NotFound);
  EXPECT_EQ(unknown.error().place.key, "figure");
  EXPECT_THAT(unknown.error().hint, HasSubstr(name));
  EXPECT_FALSE(plot_figure(job_of("", "figure.svg"), {})) << "an output requires a figure";
  PlotJob forced = job_of("");
  forced.force = true;
  EXPECT_FALSE(plot_figure(forced, {})) << "`force` has no effect when listing figures";
  EXPECT_FALSE(plot_figure(job_of(name, "figure.xyz"), {}));
  EXPECT_FALSE(plot_figure({.runs = {(folder_ / "none.mcap").string()}}, {}));
  EXPECT_EQ(test::names_in(folder_), std::vector<std::string>{});
}

}  // namespace
}  // namespace waymark
