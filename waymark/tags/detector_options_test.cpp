#include <algorithm>
#include <functional>
#include <limits>

#include <gtest/gtest.h>

#include "waymark/tags/apriltag_detector.hpp"

namespace waymark {
namespace {

TEST(DetectorOptions, EveryFieldIsNamedOnce) {
  const std::vector<std::string> names = field_names<DetectorOptions>();
  EXPECT_EQ(names.size(), 11U);
  EXPECT_EQ(std::count(names.begin(), names.end(), "quad_decimate"), 1);
}

TEST(DetectorOptions, WrongOnesAreRefusedInWords) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::pair<std::string, std::function<void(DetectorOptions&)>>> wrong = {
      {"max_hamming", [](auto& o) { o.max_hamming = 3; }},
      {"max_hamming", [](auto& o) { o.max_hamming = -1; }},
      {"quad_decimate", [](auto& o) { o.quad_decimate = 0; }},
      {"quad_decimate", [](auto& o) { o.quad_decimate = 2.5; }},
      {"quad_decimate", [](auto& o) { o.quad_decimate = 1.0001; }},
      {"quad_decimate", [&](auto& o) { o.quad_decimate = nan; }},
      {"quad_sigma", [](auto& o) { o.quad_sigma = -0.8; }},
      {"quad_sigma", [&](auto& o) { o.quad_sigma = nan; }},
      {"decode_sharpening", [](auto& o) { o.decode_sharpening = 5; }},
      {"min_white_black_diff", [](auto& o) { o.min_white_black_diff = 0; }},
      {"memory_limit_mib", [](auto& o) { o.memory_limit_mib = 0; }},
      {"families", [](auto& o) { o.families = {}; }},
      {"families",
       [](auto& o) {
         o.families = {"tag36h11", "tag36h12"};
       }},
  };
  for (const auto& [key, change] : wrong) {
    DetectorOptions options;
    change(options);
    const auto made = make_apriltag_detector(options);
    ASSERT_FALSE(made) << key;
    EXPECT_EQ(made.error().code, ErrorCode::InvalidArgument) << key;
    EXPECT_EQ(made.error().place.key, key);
    EXPECT_FALSE(made.error().hint.empty()) << key;
  }
}

TEST(DetectorOptions, TablesBeyondTheMemoryLimitAreRefusedBeforeTheyAreMade) {
  DetectorOptions options;
  options.families = {"tagStandard52h13"};
  options.max_hamming = 2;
  const auto made = make_apriltag_detector(options);
  ASSERT_FALSE(made);
  EXPECT_EQ(
      to_string(made.error()),
      "(max_hamming): correcting 2 bits of tagStandard52h13 needs decoding tables of 6033 MiB, more than 512 "
      "MiB. Lower max_hamming, name fewer families or raise memory_limit_mib.");
}

TEST(DetectorOptions, AllFamiliesTogetherFitTheDefaultLimit) {
  DetectorOptions options;
  std::int64_t bytes = 0;
  for (const FamilyId id : kAllFamilies) bytes += decode_table_bytes(family(id), options.max_hamming);
  EXPECT_LT(bytes, std::int64_t{options.memory_limit_mib} << 20);
}

}  // namespace
}  // namespace waymark
