#include "waymark/evaluation/truth.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace waymark {
namespace {

using ::testing::HasSubstr;

const std::string kHeader = "image,id,x0,y0,x1,y1,x2,y2,x3,y3";

std::string failure(const std::string& text) {
  const auto truth = parse_truth(text, "truth.csv");
  return truth ? "parsed" : to_string(truth.error());
}

TEST(Truth, ReadsWhatIsThere) {
  const auto truth =
      parse_truth("size,tilt_deg,family," + kHeader + ",extra\n" + "12,30,,a,7,0,0,10,0,10,10,0,10,?\n" +
                      ",,16h5,a,3,5,5,9,5,9,9,5,9,\n" + ",,,empty,,,,,,,,,,\n",
                  "truth.csv");
  ASSERT_TRUE(truth) << to_string(truth.error());
  ASSERT_EQ(truth->size(), 2U);
  EXPECT_TRUE(truth->at("empty").empty());
  const auto& tags = truth->at("a");
  ASSERT_EQ(tags.size(), 2U);
  EXPECT_EQ(tags[0].tag, (TagId{FamilyId::Tag36h11, 7}));
  EXPECT_EQ(tags[0].size_px, 12);
  EXPECT_EQ(tags[0].tilt_deg, 30);
  EXPECT_EQ(tags[0].corners_px[2], Eigen::Vector2d(10, 10));
  EXPECT_EQ(tags[0].corners_px[3], Eigen::Vector2d(0, 10));
  EXPECT_EQ(tags[1].tag, (TagId{FamilyId::Tag16h5, 3}));
  EXPECT_EQ(tags[1].size_px, 4);  // the mean side, for want of a size
  EXPECT_FALSE(tags[1].tilt_deg);
}

TEST(Truth, SaysLineColumnAndCure) {
  EXPECT_THAT(failure("image,id,x0,y0,x1,y1,x2,y2,x3,yy3\n"),
              HasSubstr("truth.csv (y3): no column 'y3'. Did you mean 'yy3'?"));
  EXPECT_THAT(failure(kHeader + "\na,7,0,0,10,0,10,ten,0,10\n"),
              HasSubstr("truth.csv:2 (y2): 'ten' is not a finite number"));
  EXPECT_THAT(failure(kHeader + "\na,7.5,0,0,10,0,10,10,0,10\n"),
              HasSubstr("truth.csv:2 (id): '7.5' is not a whole"));
  EXPECT_THAT(failure(kHeader + "\na,587,0,0,10,0,10,10,0,10\n"),
              HasSubstr("truth.csv:2 (id): tag36h11 has no tag 587"));
  EXPECT_THAT(failure(kHeader + "\na,-1,0,0,10,0,10,10,0,10\n"), HasSubstr("truth.csv:2 (id)"));
  EXPECT_THAT(failure(kHeader + "\n,1,0,0,10,0,10,10,0,10\n"), HasSubstr("truth.csv:2 (image): no image"));
  EXPECT_THAT(failure(kHeader + ",family\na,1,0,0,10,0,10,10,0,10,tag36h12\n"),
              HasSubstr("truth.csv:2 (family)"));
  EXPECT_THAT(failure(kHeader + ",tilt_deg\na,1,0,0,10,0,10,10,0,10,91\n"),
              HasSubstr("91 is outside [0, 90]"));
  EXPECT_THAT(failure(kHeader + ",size\na,1,0,0,10,0,10,10,0,10,-1\n"), HasSubstr("truth.csv:2 (size)"));
}

TEST(Truth, FindsTheImageOfAPath) {
  const DetectionTruth truth = {{"A_010_0", {}}, {"left/1.png", {}}, {"1", {}}, {".hidden", {}}};
  EXPECT_EQ(find_image(truth, "data/clean/A_010_0.png"), "A_010_0");
  EXPECT_EQ(find_image(truth, "A_010_0"), "A_010_0");
  EXPECT_EQ(find_image(truth, "/x/left/1.png"), "left/1.png");  // the longest name wins
  EXPECT_EQ(find_image(truth, "/x/right/1.png"), "1");
  EXPECT_EQ(find_image(truth, "/x/.hidden"), ".hidden");
  EXPECT_EQ(find_image(truth, "A_010_00.png"), std::nullopt);
  EXPECT_EQ(find_image(truth, ""), std::nullopt);
}

}  // namespace
}  // namespace waymark
