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

/// A tag with the predicted positions of its corners in an image: TL, TR, BR, BL of the print [px].
struct ExpectedTag {
  TagId tag;
  std::array<Eigen::Vector2d, 4> corners_px{};
};

/// Reason why an expected tag was not found.
enum class MissReason : std::uint8_t {
  Outside,   ///< a corner is outside the image
  TooFaint,  ///< black and white differ by less than min_white_black_diff: too dark, or overexposed
  Blurred,   ///< the steepest change of level is wider than a cell of the tag
  Occluded,  ///< there is contrast but not this tag: it is covered, or the prediction is wrong
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
/// The nearest of these detections of this tag, or nullptr.
[[nodiscard]] const TagDetection* nearest(const std::vector<TagDetection>& found,
                                          const ExpectedTag& expected);
/// Whether one of these detections is this tag, within its own size of the prediction.
[[nodiscard]] bool found_at(const std::vector<TagDetection>& found, const ExpectedTag& expected);

/// Likely reason why an expected tag was not found. O(pixels of its box).
[[nodiscard]] MissReason why_missed(const ImageView& image, const ExpectedTag& expected, int cells_across,
                                    int min_white_black_diff);
/// The expected tags that are not among the detections, with reasons.
[[nodiscard]] std::vector<MissedTag> missed_tags(const ImageView& image,
                                                 std::span<const ExpectedTag> expected,
                                                 const std::vector<TagDetection>& found,
                                                 int min_white_black_diff);

/// Search strategy for image sequences.
struct TrackingOptions {
  DetectorOptions detector{};  ///< of the underlying detector: families, corrected bits, minimum contrast
  int whole_every = 30;        ///< one image in this many is searched entirely, 1 to 1000
  /// Searches a strip of every image but the first instead, so that all images cost the same and after
  /// `whole_every` images every part was searched.
  bool in_strips = false;
};

/// The tags of one image in a sequence.
struct TrackedTags {
  std::vector<TagDetection> detections;  ///< sorted like a detector's result
  std::vector<MissedTag> missed;         ///< expected tags that were not found
  bool whole = false;                    ///< whether the entire image was searched
};

/// Finds tags in consecutive images of one camera. An expected tag is read at its predicted position, which
/// takes some microseconds; if that fails, the image is searched around it, for large tags at a smaller
/// scale. The first image, one in `whole_every`, and images in which no expected tag is found, are searched
/// entirely; alternatively each image has another strip searched. The expected tags are those predicted by
/// the caller (from a pose and a map) and those of the last image, extrapolated from their motion since the
/// image before it.
class TagTracker {
 public:
  /// `detector` must outlive the tracker. Errors: options out of range, or unknown families.
  [[nodiscard]] static Result<TagTracker> make(const Detector& detector, const TrackingOptions& options);
  TagTracker(TagTracker&&) noexcept;
  TagTracker& operator=(TagTracker&&) = delete;
  ~TagTracker();

  /// The tags of the next image. Fails if the detector fails; the next image is then searched entirely.
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
  int since_whole_ = 0;  ///< images since the last full search; 0: the next one is searched entirely
  int strip_ = 0;        ///< the next one, counted from the top
  std::vector<TagDetection> last_;
  std::vector<ExpectedTag> moved_;  ///< tags of the last image at their predicted positions in the next one
};

}  // namespace waymark
