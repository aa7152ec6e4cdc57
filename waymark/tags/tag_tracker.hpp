#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "waymark/tags/detector.hpp"
#include "waymark/tags/detector_options.hpp"

namespace waymark {

/// A tag and where its corners should be in a picture: TL, TR, BR, BL of the print [px].
struct ExpectedTag {
  TagId tag;
  std::array<Eigen::Vector2d, 4> corners_px{};
};

/// How the pictures of a sequence are searched.
struct TrackingOptions {
  DetectorOptions detector{};  ///< of the detector behind it: families, corrected bits, least contrast
  int whole_every = 30;        ///< one picture in so many is searched wholly, 1 to 1000
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

/// The tags of one picture of a sequence.
struct TrackedTags {
  std::vector<TagDetection> detections;  ///< sorted as those of a detector
  std::vector<MissedTag> missed;         ///< expected tags that were not found
  bool whole = false;                    ///< whether the whole picture was searched
};

/// Finds tags in the pictures of one camera, one after the other. A tag that is expected is read where it
/// should be, at a cost of some microseconds; where that fails, the picture is searched around it, large tags
/// at a smaller scale. The first picture, every one in `whole_every`, and one in which nothing that was
/// expected is found, are searched wholly. Expected is what the caller says (from a pose and a map), and what
/// the last picture showed, moved as it moved since the one before.
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
  void remember(const std::vector<TagDetection>& found);

  const Detector* detector_;
  TrackingOptions options_;
  std::unique_ptr<Reader> reader_;
  int since_whole_ = 0;  ///< pictures; 0: the next one is searched wholly
  std::vector<TagDetection> last_;
  std::vector<ExpectedTag> moved_;  ///< where those of the last picture should be in the next one
};

/// Why a tag may not have been found where it was expected. O(pixels of its box).
[[nodiscard]] MissReason why_missed(const ImageView& image, const ExpectedTag& expected, int cells_across,
                                    int min_white_black_diff);

}  // namespace waymark
