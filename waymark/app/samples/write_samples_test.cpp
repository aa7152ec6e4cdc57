#include "waymark/app/samples/write_samples.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/data.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

/// A control that cancels the job on the given call to cancelled().
JobControl cancelled_at_call(int call) {
  JobControl control;
  control.cancelled = [call, asked = 0]() mutable { return ++asked >= call; };
  return control;
}

TEST(WriteSamples, WritesNothingIfCancelledOrIfTheFolderIsNotEmpty) {
  const fs::path folder = testing::fresh_folder("write_samples");
  const std::string wanted = (folder / "samples").string();
  EXPECT_FALSE(write_samples({.folder = wanted}, cancelled_at_call(1)));
  EXPECT_FALSE(fs::exists(wanted));
  fs::create_directories(wanted);
  std::ofstream(fs::path(wanted) / "mine.txt") << "mine";
  EXPECT_FALSE(write_samples({.folder = wanted}, {}));
  EXPECT_EQ(std::distance(fs::directory_iterator(wanted), {}), 1);
}

TEST(SamplesReport, NamesFolderSeedAndFiles) {
  EXPECT_EQ(to_json(fields(SamplesReport{"samples", 2, {"lap.mcap", "map"}})).dump(),
            R"({"folder":"samples","seed":2,"files":["lap.mcap","map"]})");
}

}  // namespace
}  // namespace waymark
