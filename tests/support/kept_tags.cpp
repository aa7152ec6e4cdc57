#include "tests/support/kept_tags.hpp"

#include "tests/support/degraded_tags.hpp"
#include "waymark/evaluation/detections.hpp"
#include "waymark/tags/make_detector.hpp"

namespace waymark::testing {
namespace {

using refinement::Quad;
using Vector8 = Eigen::Matrix<double, 8, 1>;

Vector8 difference(const Quad& a, const Quad& b) {
  Vector8 error;
  for (std::size_t k = 0; k < 4; ++k) error.segment<2>(2 * static_cast<Eigen::Index>(k)) = a[k] - b[k];
  return error;
}

}  // namespace

const std::vector<KeptSet>& kept_sets() {
  static const std::vector<KeptSet> kSets = {{"tiny", 10}, {"faint", 24}, {"cut", 3},    {"covered", 5},
                                             {"bent", 6},  {"glare", 4},  {"moving", 6}, {"bright", 8},
                                             {"bar", 2},   {"mixed", 3}};
  return kSets;
}

std::vector<Kept> kept_tags(const std::string& set, std::size_t images, std::uint64_t seed) {
  DetectorOptions options;
  options.max_hamming = 2;
  if (set == "faint") options.min_white_black_diff = 5;
  const auto detector = make_detector(options).value();
  std::vector<Kept> kept;
  for (std::size_t i = 0; i < images; ++i) {
    const TagImage photo = tag_image(set, i, seed);
    const auto tags = detector->detect(photo.image).value();
    for (const MatchedPair& pair : match_detections(tags, photo.truth).correct) {
      const TagDetection& tag = tags[pair.detection];
      const Quad& truth = photo.truth[pair.truth].corners_px;
      const RefinedCorners corners = refine_corners(photo.image, tag);
      if (corners.refined()) continue;
      const refinement::PrintedTag print = refinement::printed_tag(photo.image, tag.tag, tag.corners_px);
      kept.push_back({corners, print, refinement::place_by_steps(photo.image, print, tag.corners_px),
                      difference(corners.corners_px, truth), difference(tag.corners_px, truth)});
    }
  }
  return kept;
}

}  // namespace waymark::testing
