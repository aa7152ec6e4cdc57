// Pieces of SDF as text, and what is said where there is no file to read.
#include "waymark/sdf/sdf_text.hpp"

#include <cstdio>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/base/random.hpp"
#include "waymark/sdf/read_sdf.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(SdfText, APoseIsReadBackAsTheSameRotation) {
  Random random(5);
  for (int i = 0; i < 50; ++i) {
    const SE3 pose(SO3::exp({random.normal(), random.normal(), random.normal()}), {random.normal(), 2, -3});
    double x = 0, y = 0, z = 0, roll = 0, pitch = 0, yaw = 0;
    ASSERT_EQ(std::sscanf(sdf_text::pose(pose).c_str(), "<pose>%lf %lf %lf %lf %lf %lf</pose>", &x, &y, &z,
                          &roll, &pitch, &yaw),
              6);
    EXPECT_LT((Eigen::Vector3d(x, y, z) - pose.translation()).norm(), 1e-5);
    EXPECT_LT((SO3::from_rpy(roll, pitch, yaw).inverse() * pose.rotation()).log().norm(), 1e-7);
  }
}

TEST(SdfText, NamesDoNotBreakTheXml) {
  const std::string model = sdf_text::fixed_model("a<b>&'c'", SE3(), sdf_text::solid("x\"y", SE3(), "", 0.5));
  EXPECT_THAT(model, Not(HasSubstr("a<b>")));
  EXPECT_THAT(model, HasSubstr("&lt;b&gt;&amp;"));
  EXPECT_THAT(model, HasSubstr("<static>true</static>"));
  std::size_t quotes = 0;
  for (const char c : model) quotes += c == '\'' ? 1 : 0;
  EXPECT_EQ(quotes % 2, 0U) << model;
}

TEST(SdfText, GreyIsTheSameInAllColours) {
  EXPECT_THAT(sdf_text::grey(0.25), HasSubstr("<diffuse>0.250 0.250 0.250 1</diffuse>"));
  EXPECT_EQ(sdf_text::box({1, 2, 3}),
            "<geometry><box><size>1.000000 2.000000 3.000000</size></box></geometry>");
}

TEST(ReadSdf, WhatIsNoFileIsSaidBeforeAnythingIsLoaded) {
  const auto missing = read_sdf("/nowhere/world.sdf");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::NotFound);
  EXPECT_EQ(missing.error().place.source, "/nowhere/world.sdf");
  const fs::path folder = testing::fresh_folder("read_sdf");
  const auto no_file = read_sdf(folder);
  ASSERT_FALSE(no_file);
  EXPECT_EQ(no_file.error().message, "this is no file");
  std::ofstream(folder / "large.sdf") << "x";
  fs::resize_file(folder / "large.sdf", (64U << 20U) + 1U);  // a hole
  const auto large = read_sdf(folder / "large.sdf");
  ASSERT_FALSE(large);
  EXPECT_EQ(large.error().code, ErrorCode::LimitExceeded);
}

}  // namespace
}  // namespace waymark
