// Which lenses a calibration tries: those that its output can hold.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/app/calibrate_camera/calibrate_camera.hpp"

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

TEST(CheckOutputs, AnEndingPromisesNoOtherFormat) {
  for (const CalibrateCameraJob& job :
       {job_of("x.txt"), job_of("x.json", "ros"), job_of("x.yaml", "photonvision")})
    EXPECT_THAT(to_string(check_outputs(job).error()), HasSubstr("is no name for a calibration"))
        << job.output;
  for (const CalibrateCameraJob& job :
       {job_of("x.yml"), job_of("x.json"), job_of("x.yaml", "ros"), job_of("")})
    EXPECT_TRUE(check_outputs(job)) << job.output;
  EXPECT_EQ(to_string(check_outputs(job_of("x.txt", "ros")).error()),
            "(--output): x.txt is no name for a calibration of the format ros. End it in .yaml, or in .json "
            "for PhotonVision.");
}

}  // namespace
}  // namespace waymark
