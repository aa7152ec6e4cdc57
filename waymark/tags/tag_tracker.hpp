#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/detector.hpp"

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

/// How the pictures of a sequence are searched.
struct TrackingOptions {
  DetectorOptions detector{};  ///< of the detector behind it: families, corrected bits, least contrast
  int whole_every = 30;        ///< one picture in so many is searched wholly, 1 to 1000
  /// Each picture but the first has a strip of it searched instead, so that each costs the same and after
  /// `whole_every` pictures every place was searched.
  bool in_strips = false;
};

/// The tags of one picture of a sequence.
struct TrackedTags {
  std::vector<TagDetection> detections;  ///< sorted as those of a detector
  std::vector<MissedTag> missed;         ///< expected tags that were not found
  bool whole = false;                    ///< whether the whole picture was searched
};

/// Finds tags in the pictures of one camera, one after the other. A tag that is expected is read where it
/// should be, at a cost of some microseconds; where that fails, the picture is searched around it, large tags
/// at a smaller scale. The first picture, every one in `whole_every`, and one in which nothing that was
/// expected is found, are searched wholly; or each has another strip searched. Expected is what the caller
/// says (from a pose and a map), and what the last picture showed, moved as it moved since the one before.
class TagTracker {
 public:
  /// `detector` outlives the tracker. Errors: options out of range, or unknown families.
  [[nodiscard]] static Result<TagTracker> make(const Detector& detector, const TrackingOptions& options);
  TagTracker(TagTracker&&) noexcept;
  TagTracker& operator=(TagTracker&&) = delete;
  ~TagTracker();

  /// The tags of the next picture. Errors are those of the detector; the next picture is then searched
  /// wholly.
  [[nodiscard]] Result<TrackedTags> next(const ImageView& image, std::span<const ExpectedTag> expected = {});

 private:
  struct Reader;
  TagTracker(const Detector& detector, const TrackingOptions& options, std::unique_ptr<Reader> reader);
  [[nodiscard]] std::vector<ExpectedTag> all_expected(std::span<const ExpectedTag> given) const;
  Status search_around(const ImageView& image, const ExpectedTag& tag, std::vector<TagDetection>& found);
  Status search_region(const ImageView& image, const PixelRect& region, int factor,
                       std::vector<TagDetection>& found);
  Status search_strip(const ImageView& image, std::vector<TagDetection>& found);
  void remember(const std::vector<TagDetection>& found);

  const Detector* detector_;
  TrackingOptions options_;
  std::unique_ptr<Reader> reader_;
  int since_whole_ = 0;  ///< pictures; 0: the next one is searched wholly
  int strip_ = 0;        ///< the next one, counted from above
  std::vector<TagDetection> last_;
  std::vector<ExpectedTag> moved_;  ///< where those of the last picture should be in the next one
};

}  // namespace waymark
