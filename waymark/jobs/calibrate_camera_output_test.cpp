// Which lenses a calibration tries: those that its output can hold.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/jobs/calibrate_camera.hpp"

namespace waymark {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

CalibrateCameraJob job_of(const std::string& output, const std::string& format = "") {
  return {.output = output, .format = format};
}

TEST(FitOptions, AnAutomaticLensIsOneThatTheFormatHolds) {
  for (const CalibrateCameraJob& job : {job_of("a.json"), job_of("a.yaml", "photonvision")}) {
    EXPECT_THAT(fit_options(job).lenses, Not(Contains(LensModel::Equidistant)));
    EXPECT_THAT(fit_options(job).lenses, Contains(LensModel::Rational8));
  }
  EXPECT_THAT(fit_options(job_of("a.yaml", "kalibr")).lenses, Not(Contains(LensModel::Rational8)));
  EXPECT_THAT(fit_options(job_of("a.yaml", "kalibr")).lenses, Contains(LensModel::Equidistant));
  for (const CalibrateCameraJob& job : {job_of("a.yaml"), job_of(""), job_of("a.yaml", "ros")})
    EXPECT_EQ(fit_options(job).lenses, lens_models()) << job.format;
}

TEST(FitOptions, WhatIsNotTriedIsNamed) {
  EXPECT_THAT(words_of_untried_lenses(job_of("a.json")),
              HasSubstr("photonvision does not hold it: --lens equidistant"));
  EXPECT_EQ(words_of_untried_lenses(job_of("a.yaml")), "");
  CalibrateCameraJob chosen = job_of("a.json");
  chosen.lens = "radtan5";
  EXPECT_EQ(words_of_untried_lenses(chosen), "");
}

}  // namespace
}  // namespace waymark
