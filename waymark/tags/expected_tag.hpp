#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark {

/// A tag and where its corners should be in a picture: TL, TR, BR, BL of the print [px].
struct ExpectedTag {
  TagId tag;
  std::array<Eigen::Vector2d, 4> corners_px{};
};

/// Why a tag was not found where it was expected.
enum class MissReason : std::uint8_t {
  Outside,   ///< a corner lies outside the picture
  TooFaint,  ///< black and white differ by less than min_white_black_diff there: too dark, or washed out
  Blurred,   ///< the steepest change of level takes longer than a cell of the tag
  Occluded,  ///< there is contrast, and it is not this tag: something covers it, or the expectation is wrong
};
[[nodiscard]] std::string_view to_string(MissReason reason);

struct MissedTag {
  ExpectedTag expected;
  MissReason why = MissReason::Occluded;
};

/// The smallest box around the corners [px].
[[nodiscard]] Eigen::AlignedBox2d box_of(const std::array<Eigen::Vector2d, 4>& corners_px);
/// Whether the corners are those of a quad that a picture can show a part of, and not much larger than it.
[[nodiscard]] bool usable(const ExpectedTag& expected, const ImageView& image);
/// The nearest of these detections of this tag, if there is one.
[[nodiscard]] const TagDetection* nearest(const std::vector<TagDetection>& found,
                                          const ExpectedTag& expected);
/// Whether one of these is this tag, no farther off than it is large.
[[nodiscard]] bool found_at(const std::vector<TagDetection>& found, const ExpectedTag& expected);

/// Why a tag may not have been found where it was expected. O(pixels of its box).
[[nodiscard]] MissReason why_missed(const ImageView& image, const ExpectedTag& expected, int cells_across,
                                    int min_white_black_diff);
/// The expected tags that are not among these, and why.
[[nodiscard]] std::vector<MissedTag> missed_tags(const ImageView& image,
                                                 std::span<const ExpectedTag> expected,
                                                 const std::vector<TagDetection>& found,
                                                 int min_white_black_diff);

}  // namespace waymark
