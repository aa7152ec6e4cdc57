#include "waymark/app/common/output_files.hpp"

#include <fstream>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "tests/support/recorded_lap.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

void write(const fs::path& path, const std::string& text) { std::ofstream(path) << text; }

class Staged : public ::testing::Test {
 protected:
  fs::path folder_ = testing::fresh_folder("staged") / "map";
};

TEST_F(Staged, FilesAppearTogether) {
  auto staged = StagedFolder::open(folder_);
  ASSERT_TRUE(staged);
  write(staged->path() / "map.yaml", "new");
  write(staged->path() / "route.yaml", "new");
  EXPECT_FALSE(fs::exists(folder_ / "map.yaml"));
  const auto aside = staged->put_in_place({});
  ASSERT_TRUE(aside);
  EXPECT_THAT(*aside, IsEmpty());
  EXPECT_EQ(test::file_text(folder_ / "map.yaml"), "new");
}

TEST_F(Staged, NothingRemainsUnlessPutInPlace) {
  {
    auto staged = StagedFolder::open(folder_);
    ASSERT_TRUE(staged);
    write(staged->path() / "map.yaml", "new");
  }
  EXPECT_FALSE(fs::exists(folder_)) << "the folder created for it is removed too";
}

TEST_F(Staged, ExistingFilesAreBackedUpUnderOneNumber) {
  fs::create_directories(folder_);
  write(folder_ / "map.yaml", "old");
  write(folder_ / "route.yaml", "old");
  write(folder_ / "route.1.yaml", "older");
  write(folder_ / "mine.txt", "mine");
  auto staged = StagedFolder::open(folder_);
  ASSERT_TRUE(staged);
  write(staged->path() / "map.yaml", "new");
  EXPECT_EQ(staged->number_for({"route.yaml"}), 2);
  const auto aside = staged->put_in_place({"route.yaml"});
  ASSERT_TRUE(aside);
  EXPECT_THAT(*aside, ElementsAre("map.yaml", "route.yaml"));
  EXPECT_EQ(test::file_text(folder_ / "map.yaml"), "new");
  EXPECT_EQ(test::file_text(folder_ / "map.2.yaml"), "old");
  EXPECT_EQ(test::file_text(folder_ / "route.2.yaml"), "old");
  EXPECT_EQ(test::file_text(folder_ / "route.1.yaml"), "older");
  EXPECT_EQ(test::file_text(folder_ / "mine.txt"), "mine");
  EXPECT_FALSE(fs::exists(folder_ / "route.yaml"));
}

TEST_F(Staged, IdenticalFilesAreNotBackedUp) {
  fs::create_directories(folder_);
  write(folder_ / "robot.yaml", "same");
  auto staged = StagedFolder::open(folder_);
  ASSERT_TRUE(staged);
  write(staged->path() / "robot.yaml", "same");
  const auto aside = staged->put_in_place({});
  ASSERT_TRUE(aside);
  EXPECT_THAT(*aside, IsEmpty());
  EXPECT_FALSE(fs::exists(folder_ / "robot.1.yaml"));
}

TEST_F(Staged, AFileInPlaceOfTheFolderIsAnError) {
  write(folder_, "a file");
  const Status status = check_output_folder(folder_);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::Unwritable);
  EXPECT_EQ(status.error().place.source, folder_.string());
}

TEST_F(Staged, ErrorsContainTheFinalPath) {
  auto staged = StagedFolder::open(folder_);
  ASSERT_TRUE(staged);
  const Error error =
      staged->failed({ErrorCode::Unwritable, "no", {.source = (staged->path() / "map.yaml").string()}})
          .value();
  EXPECT_EQ(error.place.source, (folder_ / "map.yaml").string());
}

TEST_F(Staged, AnOutputFileRequiresItsFolder) {
  const Status missing = check_output_file(folder_ / "deep" / "out.yaml");
  ASSERT_FALSE(missing);
  EXPECT_THAT(missing.error().hint, HasSubstr("mkdir -p"));
  fs::create_directories(folder_);
  EXPECT_TRUE(check_output_file(folder_ / "out.yaml"));
  write(folder_ / "a", "a file");
  for (const fs::path& below : {folder_ / "a" / "out.yaml", folder_ / "a" / "deep" / "out.yaml"}) {
    const Status blocked = check_output_file(below);
    ASSERT_FALSE(blocked);
    EXPECT_THAT(blocked.error().message, HasSubstr("/a is a file, not a folder"));
    EXPECT_THAT(blocked.error().hint, Not(HasSubstr("mkdir")));
  }
  fs::remove(folder_ / "a");
  EXPECT_FALSE(check_output_file(folder_)) << "a folder is not a file";
  EXPECT_TRUE(check_output_file("/dev/null")) << "a device counts as a file";
  EXPECT_THAT(test::names_in(folder_), IsEmpty()) << "checking leaves nothing behind";
}

TEST_F(Staged, AnExistingFileBecomesABackupUnlessItIsIdentical) {
  fs::create_directories(folder_);
  const fs::path file = folder_ / "world.yaml";
  EXPECT_EQ(move_aside(file, "new"), std::string()) << "no such file";
  ASSERT_TRUE(write_text_file(file, "first"));
  EXPECT_EQ(move_aside(file, "first"), std::string()) << "the same text";
  EXPECT_EQ(move_aside(file, "new"), (folder_ / "world.1.yaml").string());
  ASSERT_TRUE(write_text_file(file, "second"));
  EXPECT_EQ(move_aside(file, "new"), (folder_ / "world.2.yaml").string());
  EXPECT_EQ(read_text_file(folder_ / "world.1.yaml", 100), std::string("first"));
  EXPECT_EQ(read_text_file(folder_ / "world.2.yaml", 100), std::string("second"));
  EXPECT_FALSE(fs::exists(file));
}

/// Whether the recording still exists after this session.
bool stays(const std::function<void(FreshFile&)>& session) {
  const std::filesystem::path path = testing::fresh_folder("fresh_file") / "lap.mcap";
  EXPECT_TRUE(write_text_file(path, "head"));
  {
    FreshFile file(path.string());
    session(file);
  }
  return std::filesystem::exists(path);
}

TEST(FreshFile, IsKeptOnceTheRobotSentData) {
  EXPECT_FALSE(stays([](FreshFile&) {})) << "refused before any data arrived";
  EXPECT_FALSE(stays([](FreshFile& file) { file.receive(StampedCommand{}); })) << "commands are not data";
  EXPECT_TRUE(stays([](FreshFile& file) { file.receive(Odometry{}); }));
  EXPECT_TRUE(stays([](FreshFile& file) { file.keep(); }));
}

TEST(FreshFile, IsRemovedIfNothingWasDriven) {
  EXPECT_FALSE(stays([](FreshFile& file) {
    file.receive(Odometry{});
    file.discard();
  }));
}

TEST(FreshFile, RemovesNeitherDevicesNorUnnamedFiles) {
  { const FreshFile none(""); }
  { const FreshFile device("/dev/null"); }
  EXPECT_TRUE(std::filesystem::exists("/dev/null"));
}

TEST(FreshFile, ARecordingWithoutDataIsRemoved) {
  const fs::path folder = testing::fresh_folder("fresh_file_session");
  const fs::path file = folder / "lap.mcap";
  const auto begun = [&](auto&& use) {
    write(file, "begun");
    {
      FreshFile fresh(file.string());
      use(fresh);
    }
    return fs::exists(file);
  };
  EXPECT_FALSE(begun([](FreshFile&) {}));
  EXPECT_FALSE(begun([](FreshFile& fresh) { fresh.receive(StampedCommand{}); }))
      << "sent by the program, not by the robot";
  EXPECT_TRUE(begun([](FreshFile& fresh) { fresh.receive(Odometry{}); }));
  EXPECT_TRUE(begun([](FreshFile& fresh) {
    fresh.receive(TagFrame{});
    fresh.receive(StampedCommand{});
  })) << "one sample from the robot is enough";
  EXPECT_TRUE(begun([](FreshFile& fresh) { fresh.keep(); }));
  { const FreshFile none(""); }
  { const FreshFile device("/dev/null"); }
  EXPECT_TRUE(fs::exists("/dev/null")) << "only files are removed";
  { const FreshFile none(folder.string()); }
  EXPECT_TRUE(fs::exists(folder));
}

TEST(WriteFigure, WritesEachRequestedFormat) {
  const fs::path folder = testing::fresh_folder("write_figure");
  plot::Figure figure{.title = "A figure"};
  figure.series.push_back({.name = "line", .x = {0, 1, 2}, .y = {0, 1, 4}});
  std::vector<std::string> files;
  ASSERT_TRUE(write_figure(folder / "figure.svg", figure, {".svg", ".png", ".pdf"}, files));
  EXPECT_EQ(files.size(), 3U);
  EXPECT_THAT(test::file_text(folder / "figure.svg"), HasSubstr("<svg"));
  const auto begins = [&](const char* name) {
    std::string head(4, ' ');
    std::ifstream(folder / name, std::ios::binary).read(head.data(), 4);
    return head;
  };
  EXPECT_EQ(begins("figure.png"), "\x89PNG");
  EXPECT_EQ(begins("figure.pdf"), "%PDF");
  EXPECT_FALSE(write_figure(folder / "figure.svg", figure, {".gif"}, files));
  const Status nowhere = write_figure(folder / "none" / "figure.svg", figure, {".svg"}, files);
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(files.size(), 3U) << "only written files are listed";
}

}  // namespace
}  // namespace waymark
