#include "waymark/app/common/fresh_file.hpp"

#include <functional>

#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

/// Whether the recording is there after a session in which this happened.
bool stays(const std::function<void(FreshFile&)>& session) {
  const std::filesystem::path path = testing::fresh_folder("fresh_file") / "lap.mcap";
  EXPECT_TRUE(write_text_file(path, "head"));
  {
    FreshFile file(path.string());
    session(file);
  }
  return std::filesystem::exists(path);
}

TEST(FreshFile, StaysOnceTheRobotSaidSomething) {
  EXPECT_FALSE(stays([](FreshFile&) {})) << "refused before anything was heard";
  EXPECT_FALSE(stays([](FreshFile& file) { file.receive(StampedCommand{}); }))
      << "what was sent is not heard";
  EXPECT_TRUE(stays([](FreshFile& file) { file.receive(Odometry{}); }));
  EXPECT_TRUE(stays([](FreshFile& file) { file.keep(); }));
}

TEST(FreshFile, GoesWhereNothingWasDriven) {
  EXPECT_FALSE(stays([](FreshFile& file) {
    file.receive(Odometry{});
    file.discard();
  }));
}

TEST(FreshFile, RemovesNoDeviceAndNothingWithoutAName) {
  { const FreshFile none(""); }
  { const FreshFile device("/dev/null"); }
  EXPECT_TRUE(std::filesystem::exists("/dev/null"));
}

}  // namespace
}  // namespace waymark
