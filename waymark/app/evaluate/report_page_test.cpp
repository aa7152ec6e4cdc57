// Reports on drives and maps: sections, tables and figures for the available data, and the files left after a
// cancellation.
#include "waymark/app/evaluate/report_page.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/recorded_lap.hpp"
#include "waymark/app/localize/localize_log.hpp"
#include "waymark/app/map/map_recording.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

/// A folder like those written by `waymark demo`: a lap, the map made from it, and an estimate of the lap in
/// that map.
struct Demo {
  fs::path folder = testing::fresh_folder("jobs_demo");
  std::string lap = test::record_lap(folder / "lap.mcap", 41, {.for_s = 10});
  std::string estimate = (folder / "estimate.mcap").string();
  Demo() {
    EXPECT_TRUE(map_recording({.lap = lap, .folder = folder / "map"}, {}));
    const LocalizeJob job{
        .logs = {lap}, .map = (folder / "map").string(), .output = estimate, .no_adapt = true};
    const auto inputs = read_localize_inputs(job, {});
    EXPECT_TRUE(inputs);
    EXPECT_TRUE(localize(job, *inputs, {}));
  }
};

const Demo& demo() {
  static const Demo made;
  return made;
}

Runs runs_of(const std::vector<std::string>& paths) {
  auto runs = read_runs(paths, {});
  EXPECT_TRUE(runs) << to_string(runs.error());
  return runs ? std::move(*runs) : Runs{};
}

std::vector<std::string> figure_names(const plot::PageSection& section) {
  std::vector<std::string> names;
  for (const plot::PageFigure& figure : section.figures) names.push_back(figure.name);
  return names;
}

std::vector<std::string> first_cells(const plot::PageTable& table) {
  std::vector<std::string> cells;
  for (const auto& row : table.rows) cells.push_back(row.front());
  return cells;
}

TEST(ReadRuns, AFolderContainsDrivesAndAMap) {
  const Runs runs = runs_of({demo().folder.string()});
  ASSERT_THAT(runs.drives, SizeIs(2));
  EXPECT_EQ(runs.drives[0].file, demo().lap) << "oldest first";
  EXPECT_TRUE(runs.drives[0].estimate.empty());
  EXPECT_FALSE(runs.drives[1].estimate.empty());
  ASSERT_THAT(runs.maps, SizeIs(1));
  EXPECT_TRUE(runs.maps[0].route);
  EXPECT_FALSE(runs.maps[0].trajectory.empty());
  EXPECT_EQ(drive_of(runs.maps[0], runs), &runs.drives[0]) << "map.yaml contains the name of its recording";
  EXPECT_EQ(drive_of(runs.maps[0], runs_of({demo().estimate})), nullptr);
  EXPECT_THAT(runs_of({(demo().folder / "map" / "map.yaml").string()}).maps, SizeIs(1));
}

TEST(ReadRuns, OtherFilesAreErrorsWithTheirPlace) {
  const auto place = [](const std::string& path) {
    const auto runs = read_runs({path}, {});
    EXPECT_FALSE(runs) << path;
    return runs ? std::string() : runs.error().place.source;
  };
  EXPECT_EQ(place("/nowhere/lap.mcap"), "/nowhere/lap.mcap");
  const fs::path folder = testing::fresh_folder("jobs_no_runs");
  EXPECT_EQ(place(folder.string()), folder.string());
  ASSERT_TRUE(write_text_file(folder / "words.txt", "no recording"));
  EXPECT_EQ(place((folder / "words.txt").string()), (folder / "words.txt").string());
  ASSERT_TRUE(write_text_file(folder / "map.yaml", "tags: ["));
  EXPECT_EQ(place(folder.string()), (folder / "map.yaml").string());
}

TEST(DriveSection, ContainsWhatTheRecordingContains) {
  const Runs runs = runs_of({demo().lap, demo().estimate});
  const plot::PageSection lap = drive_section(runs.drives[0]);
  EXPECT_EQ(lap.title, demo().lap);
  EXPECT_THAT(figure_names(lap), ::testing::ElementsAre("floor", "speed", "tags_in_view"));
  EXPECT_THAT(first_cells(lap.tables.at(0)), Contains("frames with two or more tags"));
  EXPECT_THAT(first_cells(lap.tables.at(0)), Not(Contains("jumps")));
  const plot::PageSection estimate = drive_section(runs.drives[1]);
  EXPECT_THAT(figure_names(estimate), Contains("error"));
  EXPECT_THAT(figure_names(estimate), Contains("heading"));
  EXPECT_THAT(first_cells(estimate.tables.at(0)), Contains("position error, RMSE"));
  EXPECT_TRUE(drive_section(DriveRun{.file = "empty"}).figures.empty());
}

TEST(MapSection, ComparesWithGroundTruthIfTheDriveIsGiven) {
  const Runs runs = runs_of({demo().folder.string()});
  JobControl control;
  std::string progress;
  control.progress = [&](const JobProgress& now) { progress = now.text; };
  const plot::PageSection known = map_section(runs.maps[0], &runs.drives[0], control);
  EXPECT_THAT(progress, HasSubstr(demo().lap));
  const auto tags = std::ranges::find(known.tables, "Tags", &plot::PageTable::caption);
  ASSERT_NE(tags, known.tables.end());
  EXPECT_EQ(tags->rows.size(), runs.maps[0].map.tags.tags.size());
  for (const auto& row : tags->rows) EXPECT_EQ(row.size(), tags->head.size());
  const plot::PageSection alone = map_section(runs.maps[0], nullptr, {});
  EXPECT_FALSE(alone.figures.empty());
  EXPECT_LE(alone.figures.size(), known.figures.size());
}

TEST(Comparison, NeedsTwoDrives) {
  EXPECT_FALSE(comparison_section(runs_of({demo().lap})));
  const Runs runs = runs_of({demo().lap, demo().estimate});
  const auto section = comparison_section(runs);
  ASSERT_TRUE(section);
  EXPECT_THAT(figure_names(*section), Contains("drives"));
  const plot::PageTable table = side_by_side(runs);
  ASSERT_THAT(table.rows, SizeIs(2));
  for (const auto& row : table.rows) EXPECT_EQ(row.size(), table.head.size());
  EXPECT_EQ(table.rows[0].back(), "-") << "a taught lap has no estimate";
  EXPECT_NE(table.rows[1].back(), "-");
}

TEST(Comparison, SensorsAreComparedIfTwoDrivesWereMeasured) {
  Runs runs;
  runs.drives = {{.file = "sim"}, {.file = "real"}, {.file = "unknown"}};
  runs.drives[0].profile = RecordingProfile{.duration_s = 10, .corner_sigma_px = 0.1};
  EXPECT_THAT(sensors_side_by_side(runs).rows, SizeIs(0)) << "a single drive is not compared";
  runs.drives[1].profile = RecordingProfile{.duration_s = 12, .image_arrival_delay_s = 0.08};
  const plot::PageTable table = sensors_side_by_side(runs);
  EXPECT_EQ(table.head, (std::vector<std::string>{"quantity", "sim", "real"}));
  const auto row = [&](const std::string& quantity) {
    const auto found = std::ranges::find_if(table.rows, [&](const auto& r) { return r.front() == quantity; });
    return found == table.rows.end() ? std::vector<std::string>{} : *found;
  };
  EXPECT_EQ(row("duration [s]"), (std::vector<std::string>{"duration [s]", "10", "12"}));
  EXPECT_EQ(row("corner noise [px]"), (std::vector<std::string>{"corner noise [px]", "0.1", "-"}));
  EXPECT_EQ(row("image latency [s]"), (std::vector<std::string>{"image latency [s]", "-", "0.08"}));
}

TEST(Comparison, AnEmptyDriveIsARowOfDashes) {
  Runs runs;
  runs.drives = {{.file = "a"}, {.file = "b"}};
  const plot::PageTable table = side_by_side(runs);
  ASSERT_THAT(table.rows, SizeIs(2));
  EXPECT_EQ(table.rows[0][1], "-");
  EXPECT_EQ(table.rows[0][6], "-");
  const auto section = comparison_section(runs);
  ASSERT_TRUE(section);
  EXPECT_TRUE(section->figures.empty());
}

TEST(ReportPage, ContainsDrivesMapsAndComparison) {
  const auto page = report_page(runs_of({demo().folder.string()}), {});
  ASSERT_TRUE(page) << to_string(page.error());
  EXPECT_THAT(page->sections, SizeIs(4)) << "two drives, a map, and the comparison";
  EXPECT_THAT(page->subtitle, HasSubstr("2 drives, 1 map."));
  for (const plot::PageFigure& figure : figures_of(*page)) EXPECT_FALSE(figure.caption.empty());
  EXPECT_FALSE(report_page({}, {})) << "there is nothing to show";
}

TEST(WriteReport, ACancelledReportLeavesThePageUnchanged) {
  const fs::path folder = testing::fresh_folder("jobs_cancelled_report");
  const fs::path page = folder / "report.html";
  for (const int questions : {0, 1, 2}) {
    const auto stopped =
        write_report({demo().folder.string()}, page, false, test::cancelled_after(questions));
    EXPECT_FALSE(stopped) << questions;
    EXPECT_FALSE(fs::exists(page));
  }
  ASSERT_TRUE(write_report({demo().lap}, page, false, {}));
  const std::string before = test::file_text(page);
  EXPECT_FALSE(write_report({demo().folder.string()}, page, false, test::cancelled_after(2)));
  EXPECT_EQ(test::file_text(page), before);
  EXPECT_EQ(test::names_in(folder), std::vector<std::string>{"report.html"});
}

TEST(WriteReport, FieldsAreWrittenAsFlags) {
  JobControl control;
  control.for_users = [](std::string_view text) {
    std::string written(text);
    if (const auto at = written.find("`anchor`"); at != std::string::npos) written.replace(at, 8, "--anchor");
    return written;
  };
  plot::Page page{.title = "Drives"};
  page.sections.push_back({.title = "A map", .words = {"give `anchor`"}});
  const auto html = html_of(page, control);
  ASSERT_TRUE(html) << to_string(html.error());
  EXPECT_THAT(*html, HasSubstr("give --anchor"));
}

TEST(WriteReport, NothingIsReadIfTheOutputCannotBeWritten) {
  int read = 0;
  JobControl control;
  control.cancelled = [&] { return ++read > 0; };
  EXPECT_FALSE(write_report({demo().lap}, "/nowhere/report.html", false, control));
  EXPECT_EQ(read, 0);
}

}  // namespace
}  // namespace waymark
