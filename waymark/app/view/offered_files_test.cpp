#include "waymark/app/view/offered_files.hpp"

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class OfferedFiles : public ::testing::Test {
 protected:
  OfferedFiles() {
    fs::create_directories(folder_);
    control_.note = [this](const std::string& words) { notes_.push_back(words); };
  }
  ~OfferedFiles() override { fs::remove_all(folder_); }
  void put(const fs::path& name, const std::string& text) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  [[nodiscard]] std::string at(const std::string& name) const { return (folder_ / name).string(); }

  fs::path folder_ = fs::temp_directory_path() / ("waymark-offered-files-" + std::to_string(getpid()));
  std::vector<std::string> notes_{};
  JobControl control_{};
};

TEST_F(OfferedFiles, OffersTheRecordingsOfAFolderAndTheFilesOfItsMap) {
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

TEST_F(OfferedFiles, NotesALinkOutOfTheFolderAndDoesNotShowIt) {
  put("shown/a.mcap", "\x89MCAP0\r\n");
  put("secret", "private");
  fs::create_symlink(folder_ / "secret", folder_ / "shown/secret.mcap");
  const auto files = offered_by(at("shown"), control_);
  ASSERT_TRUE(files);
  ASSERT_EQ(files->size(), 1U);
  EXPECT_EQ(files->front().name, "a.mcap");
  ASSERT_EQ(notes_.size(), 1U);
  EXPECT_THAT(notes_.front(), HasSubstr("secret.mcap"));
  testing::expect_on_page("view", notes_.front());
}

TEST_F(OfferedFiles, ReportsTheTypeOfAFileThatCannotBeShown) {
  put("empty.mcap", "");
  put("drive.bag", "#ROSBAG V2.0\n");
  put("letter.txt", "Dear reader");
  put("faults.yaml", "faults:\n  - {fault: camera_lost, at_s: 5}\n");
  put("any.yaml", "key: value\n");
  EXPECT_THAT(offered_by(at("drive.bag"), control_).error().hint, HasSubstr("`waymark convert "));
  for (const char* name : {"empty.mcap", "drive.bag", "letter.txt", "faults.yaml"}) {
    const auto offered = offered_by(at(name), control_);
    ASSERT_FALSE(offered) << name;
    EXPECT_EQ(offered.error().code, ErrorCode::Unsupported) << name;
    EXPECT_EQ(offered.error().place.source, at(name));
    testing::expect_on_page("view", offered.error());
  }
  EXPECT_TRUE(offered_by(at("any.yaml"), control_)) << "the page reports its type";
  EXPECT_EQ(offered_by(at("none"), control_).error().code, ErrorCode::NotFound);
  EXPECT_TRUE(offered_by("", control_)->empty());
}

}  // namespace
}  // namespace waymark
