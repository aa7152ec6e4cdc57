// Files of drives: the files that the page offers, and those that a demo may overwrite.
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/app/live/start_recording.hpp"
#include "waymark/app/session/run_demo.hpp"
#include "waymark/app/view/offered_files.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class LiveFiles : public ::testing::Test {
 protected:
  LiveFiles() {
    fs::create_directories(folder_);
    control_.note = [this](const std::string& words) { notes_.push_back(words); };
  }
  ~LiveFiles() override { fs::remove_all(folder_); }
  void put(const fs::path& name, const std::string& text) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  [[nodiscard]] std::string at(const std::string& name) const { return (folder_ / name).string(); }

  fs::path folder_ = fs::temp_directory_path() / ("waymark-live-files-" + std::to_string(getpid()));
  std::vector<std::string> notes_{};
  JobControl control_{};
};

TEST_F(LiveFiles, AFolderOffersItsRecordingsAndTheFilesOfItsMap) {
  put("b.mcap", "\x89MCAP0\r\n");
  put("a.mcap", "\x89MCAP0\r\n");
  put("map/map.yaml", "tags: {}\n");
  put("map/route-kitchen.yaml", "points: []\n");
  put("notes.txt", "nothing for the page");
  const auto files = offered_by(folder_.string(), control_);
  ASSERT_TRUE(files) << to_string(files.error());
  std::vector<std::string> names;
  for (const OfferedFile& file : *files) names.push_back(file.name);
  EXPECT_THAT(names, ElementsAre("a.mcap", "b.mcap", "route-kitchen.yaml", "map.yaml"));
  EXPECT_TRUE(notes_.empty());
}

TEST_F(LiveFiles, ALinkThatLeadsOutOfTheFolderIsNotShownAndNamed) {
  put("shown/a.mcap", "\x89MCAP0\r\n");
  put("secret", "of somebody");
  fs::create_symlink(folder_ / "secret", folder_ / "shown/secret.mcap");
  const auto files = offered_by(at("shown"), control_);
  ASSERT_TRUE(files);
  ASSERT_EQ(files->size(), 1U);
  EXPECT_EQ(files->front().name, "a.mcap");
  ASSERT_EQ(notes_.size(), 1U);
  EXPECT_THAT(notes_.front(), HasSubstr("secret.mcap is a link to somewhere else"));
}

TEST_F(LiveFiles, WhatThePageCannotShowIsNamedForWhatItIs) {
  put("empty.mcap", "");
  put("drive.bag", "#ROSBAG V2.0\n");
  put("letter.txt", "Dear reader");
  EXPECT_THAT(to_string(offered_by(at("empty.mcap"), control_).error()), HasSubstr("the file is empty"));
  EXPECT_THAT(to_string(offered_by(at("drive.bag"), control_).error()), HasSubstr("waymark convert"));
  EXPECT_THAT(to_string(offered_by(at("letter.txt"), control_).error()), HasSubstr("neither a recording"));
  EXPECT_EQ(offered_by(at("none"), control_).error().code, ErrorCode::NotFound);
  EXPECT_TRUE(offered_by("", control_)->empty());
}

TEST_F(LiveFiles, ADemoWritesOverItsOwnFilesAndNobodyElses) {
  ASSERT_TRUE(clear_demo_folder(at("demo")));
  put("demo/lap.mcap", "of the last demo");
  ASSERT_TRUE(clear_demo_folder(at("demo")));
  EXPECT_FALSE(fs::exists(at("demo/lap.mcap"))) << "it goes, so that a new one can be recorded";
  put("mine/lap.mcap", "of a person");
  const Status mine = clear_demo_folder(at("mine"));
  ASSERT_FALSE(mine);
  EXPECT_THAT(to_string(mine.error()), HasSubstr("'lap.mcap' that no demo wrote"));
  EXPECT_TRUE(fs::exists(at("mine/lap.mcap")));
}

TEST_F(LiveFiles, ANewRecordingIsNeverWrittenOverAnother) {
  const auto setup = load_setup("circuit24", "limo", 1);
  ASSERT_TRUE(setup) << to_string(setup.error());
  put("lap.mcap", "of yesterday");
  const auto recorder = start_recording(at("lap.mcap"), {.verb = "test", .driver = "none"}, *setup);
  ASSERT_FALSE(recorder);
  EXPECT_EQ(recorder.error().place.source, at("lap.mcap"));
  auto fresh = start_recording(at("new.mcap"), {.verb = "test", .driver = "none"}, *setup);
  ASSERT_TRUE(fresh) << to_string(fresh.error());
  EXPECT_TRUE(fresh->close());
  EXPECT_GT(fs::file_size(at("new.mcap")), 1000U) << "it holds how it was made, before any sample";
}

}  // namespace
}  // namespace waymark
