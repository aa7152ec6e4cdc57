#pragma once

#include <memory>
#include <span>
#include <vector>

#include "waymark/tags/detector.hpp"
#include "waymark/tags/detector_options.hpp"
#include "waymark/tags/expected_tag.hpp"

namespace waymark {

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
