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

/// A tag with the predicted positions of its corners in an image, in the order TL, TR, BR, BL of the print
/// [px].
struct ExpectedTag {
  TagId tag;
  std::array<Eigen::Vector2d, 4> corners_px{};
};

/// Reason why an expected tag was not found.
enum class MissReason : std::uint8_t {
  Outside,   ///< a corner is outside the image
  TooFaint,  ///< black and white differ by less than min_white_black_diff: the tag is too dark or overexposed
  Blurred,   ///< the steepest change in level is wider than a cell of the tag
  Occluded,  ///< there is contrast but no such tag: it is covered, or the prediction is wrong
};
[[nodiscard]] std::string_view to_string(MissReason reason);

struct MissedTag {
  ExpectedTag expected;
  MissReason why = MissReason::Occluded;
};

/// The smallest box around the corners [px].
[[nodiscard]] Eigen::AlignedBox2d box_of(const std::array<Eigen::Vector2d, 4>& corners_px);
/// Whether the corners form a quad that is at least partly in the image and not much larger than it.
[[nodiscard]] bool usable(const ExpectedTag& expected, const ImageView& image);
/// The nearest detection of this tag; nullptr if there is none.
[[nodiscard]] const TagDetection* nearest(const std::vector<TagDetection>& found,
                                          const ExpectedTag& expected);
/// Whether one of these detections is of this tag and no farther from the prediction than the size of the
/// tag.
[[nodiscard]] bool found_at(const std::vector<TagDetection>& found, const ExpectedTag& expected);

/// The likely reason why an expected tag was not found. O(pixels in its box).
[[nodiscard]] MissReason why_missed(const ImageView& image, const ExpectedTag& expected, int cells_across,
                                    int min_white_black_diff);
/// The expected tags that have not been detected, with reasons.
[[nodiscard]] std::vector<MissedTag> missed_tags(const ImageView& image,
                                                 std::span<const ExpectedTag> expected,
                                                 const std::vector<TagDetection>& found,
                                                 int min_white_black_diff);

/// Search strategy for image sequences.
struct TrackingOptions {
  DetectorOptions
      detector{};        ///< options of the underlying detector: families, corrected bits, minimum contrast
  int whole_every = 30;  ///< one in this many images is searched entirely; from 1 to 1000
  /// Instead of entire images, searches one strip in each image except the first. All images then cost the
  /// same, and after `whole_every` images every part has been searched.
  bool in_strips = false;
};

/// The tags in one image of a sequence.
struct TrackedTags {
  std::vector<TagDetection> detections;  ///< sorted like the result of a detector
  std::vector<MissedTag> missed;         ///< expected tags that were not found
  bool whole = false;                    ///< whether the entire image was searched
};

/// Finds tags in consecutive images from one camera. An expected tag is read at its predicted position, which
/// takes a few microseconds. If that fails, the image is searched around this position, at a smaller scale if
/// the tag is large. The first image, one in every `whole_every` images, and images in which no expected tag
/// is found are searched entirely. Alternatively, a different strip is searched in each image. The expected
/// tags are those predicted by the caller (from a pose and a map) and those in the last image, extrapolated
/// from their motion since the image before it.
class TagTracker {
 public:
  /// `detector` must outlive the tracker. Fails if an option is out of range or a family is unknown.
  [[nodiscard]] static Result<TagTracker> make(const Detector& detector, const TrackingOptions& options);
  TagTracker(TagTracker&&) noexcept;
  TagTracker& operator=(TagTracker&&) = delete;
  ~TagTracker();

  /// The tags in the next image. If the detector fails, this also fails, and the next image is searched
  /// entirely.
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
  int since_whole_ = 0;  ///< images since the last full search; if 0, the next one is searched entirely
  int strip_ = 0;        ///< index of the next strip, counted from the top
  std::vector<TagDetection> last_;
  std::vector<ExpectedTag> moved_;  ///< tags in the last image at their predicted positions in the next one
};

}  // namespace waymark
