// The project's own detector compared with AprilTag 3 on the first images of the rendered sets, and on the
// clean set.
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/support/corner_table.hpp"
#include "tests/support/data.hpp"
#include "tests/support/degraded_tags.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/evaluation/detections.hpp"
#include "waymark/tags/make_detector.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {
namespace {

DetectorOptions two_bits(const std::string& detector) {
  DetectorOptions options;
  options.detector = detector;
  options.max_hamming = 2;
  if (detector == "apriltag3") {  // its own settings
    options.decode_sharpening = 0.25;
    options.min_white_black_diff = 5;
  }
  return options;
}

struct Scored {
  DetectionScores own;
  DetectionScores library;
};

/// Runs both detectors on the same images, with two bits corrected.
template <class MakeImage>
Scored score_both(std::size_t images, MakeImage&& make_image, bool find_inverted = false) {
  DetectorOptions own_options = two_bits("waymark");
  own_options.find_inverted = find_inverted;
  const auto own = make_detector(own_options).value();
  const auto library = make_detector(two_bits("apriltag3")).value();
  std::vector<ImageDetections> by_own;
  std::vector<ImageDetections> by_library;
  for (std::size_t i = 0; i < images; ++i) {
    const testing::TagImage photo = make_image(i);
    by_own.push_back({own->detect(photo.image).value(), photo.truth});
    by_library.push_back({library->detect(photo.image).value(), photo.truth});
  }
  return {score_detections(by_own), score_detections(by_library)};
}

void print(const std::string& set, const Scored& scored) {
  std::cout << set << ": waymark " << scored.own.correct << ", AprilTag 3 " << scored.library.correct
            << " of " << scored.own.truth << ", seed " << testing::kSetSeed << "\n";
}

struct Expected {
  const char* set;
  std::size_t images;
  double least_share;  ///< minimum fraction of the tags
};

class RenderedSet : public ::testing::TestWithParam<Expected> {};
INSTANTIATE_TEST_SUITE_P(Sets, RenderedSet,
                         ::testing::Values(Expected{"mixed", 10, 0.55}, Expected{"single", 6, 0.7},
                                           Expected{"grid", 2, 0.95}, Expected{"shadow", 2, 0.9},
                                           Expected{"bar", 2, 0.7}, Expected{"inverted", 1, 0.9},
                                           Expected{"overexposed", 3, 0.9}),
                         [](const auto& of) { return std::string(of.param.set); });

TEST_P(RenderedSet, MoreTagsThanAprilTag3AndNoFalsePositives) {
  const Expected& expected = GetParam();
  const std::string set = expected.set;
  const Scored scored = score_both(
      expected.images, [&](std::size_t i) { return testing::tag_image(set, 5 * i); }, set == "inverted");
  print(set, scored);
  EXPECT_GE(static_cast<double>(scored.own.correct),
            expected.least_share * static_cast<double>(scored.own.truth));
  EXPECT_GT(scored.own.correct, scored.library.correct);
  EXPECT_EQ(scored.own.wrong_ids + scored.own.false_positives, 0U) << "includes tags with wrong corners";
}

/// The corners of one detector's tags before and after the refinement.
struct FoundCorners {
  testing::CornerLine corners;
  std::size_t refined = 0;
  std::size_t truth = 0;
};

/// Those of every `step`-th image of a set.
FoundCorners refined_corners(const Detector& detector, std::string_view set, std::size_t first,
                             std::size_t step, std::size_t images, std::uint64_t seed) {
  FoundCorners found;
  for (std::size_t i = 0; i < images; ++i) {
    const testing::TagImage photo = testing::tag_image(set, step * i + first, seed);
    const auto tags = detector.detect(photo.image).value();
    found.truth += photo.truth.size();
    for (const MatchedPair& pair : match_detections(tags, photo.truth).correct) {
      const TagDetection& tag = tags[pair.detection];
      const RefinedCorners result = refine_corners(photo.image, tag);
      found.refined += result.refined() ? 1 : 0;
      found.corners.add(photo.truth[pair.truth].corners_px, tag.corners_px, result.corners_px,
                        result.covariance_px2);
    }
  }
  found.corners.print(fmt::format("{} {}, {}", set, first, found.truth));
  return found;
}

class Overexposed : public ::testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Whites, Overexposed, ::testing::Values(600, 800, 1200));

TEST_P(Overexposed, TagsAreFoundAndTheirCornersAreConsistent) {
  const double white = GetParam();
  constexpr std::size_t kImages = 2;
  const std::size_t first = white < 700 ? 0 : white < 1000 ? 1 : 2;
  testing::CornerLine::print_header();
  const auto own = make_detector(two_bits("waymark")).value();
  const auto library = make_detector(two_bits("apriltag3")).value();
  const FoundCorners ours = refined_corners(*own, "overexposed", first, 3, kImages, testing::kSecondSetSeed);
  const FoundCorners theirs =
      refined_corners(*library, "overexposed", first, 3, kImages, testing::kSecondSetSeed);
  std::cout << ours.refined << " of " << ours.corners.tags() << " refined, seed " << testing::kSecondSetSeed
            << "\n";
  EXPECT_GE(ours.corners.tags(), theirs.corners.tags());
  EXPECT_LT(ours.corners.rmse_before_px(), theirs.corners.rmse_before_px());
  EXPECT_LT(ours.corners.rmse_px(), 0.5);
  EXPECT_GT(ours.corners.nees_tag(), 0.5);
  EXPECT_LT(ours.corners.nees_tag(), 2.0);
  // The refinement also corrects the corners of the other detector, which are those of the visible border.
  EXPECT_LT(theirs.corners.rmse_px(), 0.5);
}

// A spot of light changes the levels of the border, which the fit assumes to be equal, but not the steps.
TEST(Glare, LeavesCornersConsistent) {
  testing::CornerLine::print_header();
  const auto detector = make_detector(two_bits("waymark")).value();
  const FoundCorners found = refined_corners(*detector, "glare", 0, 1, 12, testing::kSecondSetSeed);
  EXPECT_GT(found.corners.tags(), 60);
  EXPECT_LT(found.corners.rmse_px(), 0.4);
  EXPECT_LT(found.corners.nees_tag(), 3);
}

// Counts are summed over all sets: a set has few unreliable corners.
TEST(UnreliableCorners, AreThoseThatAreOffAndHardlyAnyOthers) {
  constexpr double kGoodPx = 1;
  constexpr double kBadPx = 2;
  const TagFinder finder = make_tag_finder(two_bits("waymark")).value();
  int good = 0, good_marked = 0, bad = 0, bad_marked = 0;
  for (const auto& [set, images] : std::vector<std::pair<std::string, std::size_t>>{
           {"mixed", 6}, {"single", 28}, {"grid", 1}, {"shadow", 3}, {"bar", 4}, {"margin", 1}}) {
    for (std::size_t i = 0; i < images; ++i) {
      const testing::TagImage photo = testing::tag_image(set, i, testing::kSecondSetSeed);
      const FoundTags found = find_tags(photo.image, finder, ImageLens::unknown()).value();
      for (const auto& [d, t] : match_detections(found.detections, photo.truth).correct) {
        double worst_px = 0;
        for (std::size_t k = 0; k < 4; ++k)
          worst_px =
              std::max(worst_px, (found.detections[d].corners_px[k] - photo.truth[t].corners_px[k]).norm());
        const int marked = usable_corners(found.detections[d]) ? 0 : 1;
        good += worst_px < kGoodPx ? 1 : 0;
        good_marked += worst_px < kGoodPx ? marked : 0;
        bad += worst_px > kBadPx ? 1 : 0;
        bad_marked += worst_px > kBadPx ? marked : 0;
      }
    }
  }
  std::cout << "unreliable: " << good_marked << " of " << good << " within " << kGoodPx << " px, "
            << bad_marked << " of " << bad << " off by more than " << kBadPx << " px\n";
  EXPECT_LE(good_marked, 0.01 * good);
  ASSERT_GT(bad, 2);
  EXPECT_GE(bad_marked, 0.7 * bad);
}

/// The known tags are those of the image, and as many that are not in it.
TEST(KnownTags, MoreAreFoundWithoutFalsePositives) {
  std::size_t plain_found = 0;
  std::size_t known_found = 0;
  std::vector<ImageDetections> by_known;
  DetectorOptions options;  // one bit corrected
  const auto plain = make_detector(options).value();
  for (std::size_t i = 0; i < 10; ++i) {
    const testing::TagImage photo = testing::tag_image("mixed", 4 * i);
    options.known_tags.clear();
    for (const TrueTag& tag : photo.truth) {
      options.known_tags.push_back(tag.tag);
      options.known_tags.push_back({tag.tag.family, (tag.tag.number + 293) % 587});
    }
    plain_found += plain->detect(photo.image).value().size();
    by_known.push_back({make_detector(options).value()->detect(photo.image).value(), photo.truth});
    known_found += by_known.back().detections.size();
  }
  const DetectionScores scores = score_detections(by_known);
  std::cout << "mixed: " << plain_found << " tags, " << known_found << " where they are known, of "
            << scores.truth << ", seed " << testing::kSetSeed << "\n";
  EXPECT_GT(known_found, plain_found);
  EXPECT_EQ(scores.wrong_ids + scores.false_positives, 0U);
}

TEST(TagFreeImages, HaveNoTags) {
  const auto detector = make_detector(two_bits("waymark")).value();
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_TRUE(detector->detect(testing::tag_free_image(i)).value().empty()) << i;
  DetectorOptions options;
  for (int number = 0; number < 50; ++number) options.known_tags.push_back({FamilyId::Tag36h11, number});
  const auto with_known_tags = make_detector(options).value();
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_TRUE(with_known_tags->detect(testing::tag_free_image(i)).value().empty())
        << i << ", 50 tags known";
}

/// Brighter than the range of the image over about half of it.
TEST(TagFreeImages, HaveNoTagsIfOverexposed) {
  const auto detector = make_detector(two_bits("waymark")).value();
  constexpr std::size_t kImages = 4;
  for (std::size_t i = 0; i < kImages; ++i) {
    Image image = testing::tag_free_image(i, testing::kSecondSetSeed);
    const int gain = 2 + 2 * static_cast<int>(i % 3);
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        std::uint8_t& pixel = image.row(y)[x];
        pixel = static_cast<std::uint8_t>(std::clamp(60 + gain * (pixel - 90), 0, 255));
      }
    }
    EXPECT_TRUE(detector->detect(image).value().empty()) << i;
  }
}

TEST(CleanSet, IsAtLeastAprilTag3InEachClassOfSizeAndTilt) {
  WAYMARK_REAL_DATA(folder, "synth-tags/clean");
  std::ifstream file(folder / "truth.csv");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const DetectionTruth truth = parse_truth(text, "truth.csv").value();
  const std::vector<std::pair<std::string, std::vector<TrueTag>>> list(truth.begin(), truth.end());
  const Scored scored = score_both(list.size(), [&](std::size_t i) {
    testing::TagImage photo;
    photo.image = read_image(folder / (list[i].first + ".png")).value();
    photo.truth = list[i].second;
    return photo;
  });
  print("clean", scored);
  EXPECT_EQ(scored.own.wrong_ids + scored.own.false_positives, 0U);
  EXPECT_GE(scored.own.correct, scored.library.correct + 100);
  for (std::size_t size = 0; size < scored.own.by_size_and_tilt.size(); ++size) {
    for (std::size_t tilt = 0; tilt < scored.own.by_size_and_tilt[size].size(); ++tilt) {
      const ClassScores& ours = scored.own.by_size_and_tilt[size][tilt];
      EXPECT_GE(ours.found, scored.library.by_size_and_tilt[size][tilt].found)
          << "of " << ours.truth << " tags from " << scored.own.by_size[size].low << " px, tilt from "
          << ours.low << " deg";
    }
  }
}

}  // namespace
}  // namespace waymark
