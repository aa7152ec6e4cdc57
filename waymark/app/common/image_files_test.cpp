#include "waymark/app/common/image_files.hpp"

#include <filesystem>
#include <fstream>

#include <sys/stat.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class Sources : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = testing::fresh_folder("images");
    for (const char* name :
         {"b.png", "a.JPG", "Z.pgm", "notes.txt", "inner/c.jpeg", "clip.mp4", "odd[1].png"})
      touch(name);
    fs::create_directories(folder_ / "empty");
  }

  void touch(const std::string& name) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << "x";
  }
  [[nodiscard]] std::string at(const std::string& name) const { return (folder_ / name).string(); }

  /// The paths found, relative to the folder; errors appear as "!" and the error.
  [[nodiscard]] std::vector<std::string> found(const std::vector<std::string>& names,
                                               bool recursive = false) const {
    std::vector<std::string> sources;
    for (const std::string& name : names) sources.push_back(name.starts_with('/') ? name : at(name));
    std::vector<std::string> out;
    for (const Input& input : find_inputs(sources, recursive)) {
      out.push_back(input.error ? "!" + to_string(*input.error)
                                : fs::path(input.path).lexically_relative(folder_).string());
    }
    return out;
  }

 private:
  fs::path folder_;
};

TEST_F(Sources, ImagesOfAFolderAreSortedByBytes) {
  EXPECT_THAT(found({""}), ElementsAre("Z.pgm", "a.JPG", "b.png", "odd[1].png"));
  EXPECT_THAT(found({""}, true), ElementsAre("Z.pgm", "a.JPG", "b.png", "inner/c.jpeg", "odd[1].png"));
}

TEST_F(Sources, FilesKeepTheirOrderWithoutDuplicates) {
  EXPECT_THAT(found({"b.png", "a.JPG", "./b.png"}), ElementsAre("b.png", "a.JPG"));
  EXPECT_THAT(found({"notes.txt"}),
              ElementsAre("notes.txt"));  // a file specified by name is accepted with any suffix
}

TEST_F(Sources, PatternsAreExpanded) {
  EXPECT_THAT(found({"*/*.jpeg"}), ElementsAre("inner/c.jpeg"));
  EXPECT_THAT(found({"[ab].*"}), ElementsAre("a.JPG", "b.png"));
  EXPECT_THAT(found({"odd[1].png"}),
              ElementsAre("odd[1].png"));  // an existing file takes precedence over a pattern
  EXPECT_THAT(found({"*.tiff"}), ElementsAre(HasSubstr("nothing matches this pattern")));
  EXPECT_THAT(found({"em*"}), ElementsAre(HasSubstr("only folders match")));
}

TEST_F(Sources, ASourceWithoutImagesIsAnErrorThatDoesNotAffectOthers) {
  EXPECT_THAT(found({"b.png", "empty", "a.JPG"}), ElementsAre("b.png", HasSubstr("empty"), "a.JPG"));
  EXPECT_THAT(found({"c.png"}), ElementsAre(HasSubstr("b.png'?")));
  EXPECT_THAT(found({"empty/none.png"}), ElementsAre(HasSubstr("no such file or folder")));
  EXPECT_THAT(found({"/dev/video97"}), ElementsAre(HasSubstr("v4l2:/dev/video0")));
}

TEST_F(Sources, AFolderOfRecordingsPassesIfItContainsNoImage) {
  touch("bag/metadata.yaml");
  touch("bag/bag_0.db3");
  EXPECT_THAT(found({"bag"}), ElementsAre("bag"));
  touch("bag/a.png");
  EXPECT_THAT(found({"bag"}), ElementsAre("bag/a.png"));
}

TEST_F(Sources, StreamsAndDevicesAreRefusedAndVideosPass) {
  EXPECT_THAT(found({"clip.mp4"}), ElementsAre("clip.mp4"));
  EXPECT_THAT(found({"/dev/null"}), ElementsAre(HasSubstr("a device or a socket")));
  const auto stream = find_inputs({"rtsp://camera/1"}, false);
  ASSERT_EQ(stream.size(), 1U);
  ASSERT_TRUE(stream[0].error.has_value());
  EXPECT_EQ(stream[0].error.value_or(Error{}).code, ErrorCode::Unsupported);
}

}  // namespace
}  // namespace waymark
