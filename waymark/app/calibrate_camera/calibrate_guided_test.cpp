#include "waymark/app/calibrate_camera/calibrate_guided.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

std::string words(const Status& status) { return status ? "" : to_string(status.error()); }

TEST(GuidedChecks, PicturesOfTheirOwnAreNoSource) {
  const auto folder = testing::fresh_folder("live_job_checks_pictures");
  std::ofstream(folder / "a.png") << "x";
  CalibrateCameraJob job{.sources = {(folder / "a.png").string()}};
  EXPECT_THAT(words(check_guided_sources(job)), HasSubstr("is a picture: a guided calibration takes"));
  job.sources = {(folder / "a.mp4").string()};
  EXPECT_EQ(words(check_guided_sources(job)), "");
}

}  // namespace
}  // namespace waymark
