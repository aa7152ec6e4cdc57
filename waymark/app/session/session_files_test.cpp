#include "waymark/app/session/session_files.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/app/common/output_files.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

void write_words(const fs::path& path, const std::string& words) { std::ofstream(path) << words; }
std::string words_in(const fs::path& path) { return read_text_file(path, 1 << 20).value_or("no file"); }

/// Writes these words into map.yaml of the folder it is given.
MapMaker maker_of(const std::string& words) {
  return [words](const std::string& lap, const fs::path& folder) -> Status {
    fs::create_directories(folder);
    return write_text_file(folder / "map.yaml", words + " of " + fs::path(lap).filename().string());
  };
}

Status broken_maker(const std::string& /*lap*/, const fs::path& folder) {
  fs::create_directories(folder);
  write_words(folder / "map.yaml", "half of it");
  return fail(ErrorCode::NotFound, "the anchor was never seen");
}

class SessionFiles : public ::testing::Test {
 protected:
  fs::path folder_ = testing::fresh_folder("live_session");
  fs::path map_ = folder_ / "map";
  MapInTheMaking making_{};
};

TEST_F(SessionFiles, ANameIsNeverGivenTwice) {
  EXPECT_EQ(free_name(folder_, "lap"), (folder_ / "lap.mcap").string());
  write_words(folder_ / "lap.mcap", "first");
  EXPECT_EQ(free_name(folder_, "lap"), (folder_ / "lap.2.mcap").string());
  write_words(folder_ / "lap.2.mcap", "second");
  EXPECT_EQ(free_name(folder_, "lap"), (folder_ / "lap.3.mcap").string());
  EXPECT_EQ(free_name(folder_, "replay"), (folder_ / "replay.mcap").string());
}

TEST_F(SessionFiles, EachMapTakesItsPlaceAndTheOlderOnesAreKept) {
  EXPECT_FALSE(making_.under_way());
  EXPECT_FALSE(making_.ready());
  std::vector<std::string> kept;
  for (const char* words : {"first", "second", "third"}) {
    making_.begin(maker_of(words), "lap.mcap", map_);
    EXPECT_TRUE(making_.under_way());
    const auto older = making_.take();
    ASSERT_TRUE(older) << to_string(older.error());
    kept.push_back(*older);
    EXPECT_FALSE(making_.under_way());
    EXPECT_EQ(words_in(map_ / "map.yaml"), std::string(words) + " of lap.mcap");
    EXPECT_GE(making_.seconds(), 0);
  }
  EXPECT_EQ(kept, (std::vector<std::string>{"", map_.string() + ".1", map_.string() + ".2"}));
  EXPECT_EQ(words_in(map_.string() + ".1/map.yaml"), "first of lap.mcap");
  EXPECT_EQ(words_in(map_.string() + ".2/map.yaml"), "second of lap.mcap");
  EXPECT_FALSE(fs::exists(map_.string() + ".new"));
}

TEST_F(SessionFiles, AMapThatCannotBeMadeLeavesTheOlderOneAndNothingElse) {
  making_.begin(maker_of("good"), "lap.mcap", map_);
  ASSERT_TRUE(making_.take());
  making_.begin(broken_maker, "lap.2.mcap", map_);
  const auto failed = making_.take();
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().message, "the anchor was never seen");
  EXPECT_EQ(words_in(map_ / "map.yaml"), "good of lap.mcap");
  EXPECT_FALSE(fs::exists(map_.string() + ".new")) << "what was half made is gone";
  EXPECT_FALSE(fs::exists(map_.string() + ".1"));
}

TEST_F(SessionFiles, WhatASessionThatWasCutOffLeftIsNotPartOfTheNextMap) {
  fs::create_directories(map_.string() + ".new");
  write_words(map_.string() + ".new/stray.yaml", "of another session");
  making_.begin(maker_of("new"), "lap.mcap", map_);
  ASSERT_TRUE(making_.take());
  EXPECT_TRUE(fs::exists(map_ / "map.yaml"));
  EXPECT_FALSE(fs::exists(map_ / "stray.yaml"));
}

TEST_F(SessionFiles, AMakerThatMadeNothingIsAnErrorWithItsPlace) {
  fs::create_directories(map_);
  write_words(map_ / "map.yaml", "older");
  making_.begin([](const std::string&, const fs::path&) { return Status(); }, "lap.mcap", map_);
  const auto taken = making_.take();
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().code, ErrorCode::Unwritable);
  EXPECT_EQ(taken.error().place.source, map_.string());
  EXPECT_EQ(words_in(map_ / "map.yaml"), "older") << "the map that was there is still in its place";
}

TEST_F(SessionFiles, ARecordingInWhichTheRobotSaidNothingIsRemoved) {
  const fs::path file = folder_ / "lap.mcap";
  const auto begun = [&](auto&& use) {
    write_words(file, "begun");
    {
      FreshFile fresh(file.string());
      use(fresh);
    }
    return fs::exists(file);
  };
  EXPECT_FALSE(begun([](FreshFile&) {}));
  EXPECT_FALSE(begun([](FreshFile& fresh) { fresh.receive(StampedCommand{}); })) << "sent, not said";
  EXPECT_TRUE(begun([](FreshFile& fresh) { fresh.receive(Odometry{}); }));
  EXPECT_TRUE(begun([](FreshFile& fresh) {
    fresh.receive(TagFrame{});
    fresh.receive(StampedCommand{});
  })) << "what was said once counts";
  EXPECT_TRUE(begun([](FreshFile& fresh) { fresh.keep(); }));
  { const FreshFile none(""); }
  { const FreshFile device("/dev/null"); }
  EXPECT_TRUE(fs::exists("/dev/null")) << "only files are removed";
  { const FreshFile folder(folder_.string()); }
  EXPECT_TRUE(fs::exists(folder_));
}

}  // namespace
}  // namespace waymark
