#include "waymark/app/calibrate_camera/calibrate_guided.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

std::string error_text(const Status& status) { return status ? "" : to_string(status.error()); }

TEST(GuidedChecks, RejectsSingleImagesAndAMissingSource) {
  const auto folder = testing::fresh_folder("live_job_checks_images");
  std::ofstream(folder / "a.png") << "x";
  CalibrateGuidedJob job{.sources = {(folder / "a.png").string()}};
  const auto none_given = [](const char*) { return false; };
  EXPECT_THAT(error_text(check_job(job, none_given)), HasSubstr("a.png"));
  std::ofstream(folder / "a.png") << "\x89PNG\r\n\x1a\n";
  EXPECT_THAT(error_text(check_job(job, none_given)), HasSubstr("not a video"));
  job.sources = {(folder / "a.mp4").string()};
  EXPECT_EQ(error_text(check_job(job, none_given)), "");
  EXPECT_THAT(error_text(check_job(job, [](const char* field) { return std::string(field) == "view"; })),
              HasSubstr("(view): "));
  job.sources.clear();
  EXPECT_THAT(error_text(check_job(job, none_given)), HasSubstr("v4l2:/dev/video0"));
}

}  // namespace
}  // namespace waymark
