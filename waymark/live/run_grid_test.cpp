// What an experiment combines, and what it refuses before the first lap is driven.
#include "waymark/live/run_grid.hpp"

#include <algorithm>
#include <filesystem>
#include <set>

#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

std::string key_refused(const ExperimentGrid& grid) {
  const Status checked = check_grid(grid);
  return checked ? "" : checked.error().place.key;
}

TEST(CheckGrid, WhatCannotBeDrivenIsNamedByItsKey) {
  EXPECT_TRUE(check_grid({}));
  EXPECT_EQ(key_refused({.worlds = {}}), "worlds");
  EXPECT_EQ(key_refused({.controllers = {"follower", "persuit"}}), "controllers");
  EXPECT_EQ(key_refused({.speeds_m_s = {0.4, 0}}), "speeds_m_s");
  EXPECT_EQ(key_refused({.seeds = {1, 2, 1}}), "seeds");
  EXPECT_FALSE(check_grid({.worlds = {"circuit42"}}));
  EXPECT_FALSE(check_grid({.faults = {"no-such-faults.yaml"}}));
}

TEST(ReadGrid, AnEmptyFileIsAnAccidentAndAMistakeIsNamedWithItsFile) {
  const fs::path file = testing::fresh_folder("read_grid") / "grid.yaml";
  const auto read = [&](const std::string& text) {
    EXPECT_TRUE(write_text_file(file, text));
    return read_grid(file.string());
  };
  const auto good = read("seeds: [1, 2, 3]\nspeeds_m_s: [0.3]\n");
  ASSERT_TRUE(good) << to_string(good.error());
  EXPECT_EQ(good->seeds.size(), 3U);
  for (const char* text : {"", "# nothing\n", "sedes: [1]\n", "seeds: [1, 1]\n", "speeds_m_s: [-1]\n"}) {
    const auto bad = read(text);
    ASSERT_FALSE(bad) << text;
    EXPECT_EQ(bad.error().place.source, file.string()) << text;
  }
}

TEST(ExperimentFolder, WhatTookHoursIsWrittenOverOnlyWhenThatIsAskedFor) {
  const fs::path folder = testing::fresh_folder("experiment_folder");
  EXPECT_TRUE(check_experiment_folder(folder, false));
  EXPECT_TRUE(check_experiment_folder(folder / "new", false));
  ASSERT_TRUE(write_text_file(folder / "experiment.json", "{}"));
  EXPECT_FALSE(check_experiment_folder(folder, false));
  EXPECT_TRUE(check_experiment_folder(folder, true));
  fs::remove(folder / "experiment.json");
  fs::create_directories(folder / "lap-1");
  EXPECT_FALSE(check_experiment_folder(folder, false)) << "it was stopped before its end";
}

class RunGrid : public ::testing::Test {
 protected:
  const fs::path folder_ = testing::fresh_folder("run_grid");
};

TEST_F(RunGrid, EveryCombinationIsDrivenOnceOnTheLapOfItsWorldAndSeed) {
  const fs::path blind = folder_ / "blind.yaml";
  ASSERT_TRUE(write_text_file(blind, "faults:\n  - {fault: camera_lost, at_s: 5, for_s: 600}\n"));
  const ExperimentGrid grid{
      .controllers = {"follower", "pursuit"}, .faults = {kNoFaults, blind.string()}, .seeds = {1}};
  const Status checked = check_grid(grid);
  ASSERT_TRUE(checked) << to_string(checked.error());
  const auto runs = run_grid(grid, folder_ / "runs", {});
  ASSERT_TRUE(runs) << to_string(runs.error());
  ASSERT_EQ(runs->size(), 4U);
  std::set<std::pair<std::string, std::uint64_t>> different;
  for (const ExperimentRun& run : *runs) different.emplace(run.cell, run.seed);
  EXPECT_EQ(different.size(), runs->size());
  EXPECT_TRUE(fs::exists(folder_ / "runs/lap-1/map/map.yaml"));
  EXPECT_FALSE(fs::exists(folder_ / "runs/lap-2"));
  for (const ExperimentRun& run : *runs) {
    const bool blinded = run.cell.find("blind.yaml") != std::string::npos;
    EXPECT_EQ(run.finished, !blinded) << run.cell << ": " << run.ending;
  }
}

TEST_F(RunGrid, CancellingEndsWithWhatWasDriven) {
  JobControl control;
  int asked = 0;
  control.cancelled = [&] { return ++asked > 1; };
  const auto runs = run_grid({.worlds = {"mbot-square"}, .seeds = {1, 2, 3}}, folder_ / "runs", control);
  EXPECT_TRUE(!runs || runs->size() < 3);
  EXPECT_FALSE(fs::exists(folder_ / "runs/lap-3"));
}

}  // namespace
}  // namespace waymark
