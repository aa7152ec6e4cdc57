#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/families/family.hpp"
#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark {

/// Size of the largest image accepted, e.g. 8192 x 8192; no side may exceed 32767.
inline constexpr std::int64_t kMaxImagePixels = std::int64_t{1} << 26;

/// A rectangle of pixels: [x, x + width) x [y, y + height).
struct PixelRect {
  int x = 0, y = 0, width = 0, height = 0;
};

/// Finds tags in a grey image. Implementations are interchangeable; all return finite corners in full-image
/// pixels. Tags are sorted by id and then by position, so the result is deterministic.
class Detector {
 public:
  virtual ~Detector() = default;
  Detector(const Detector&) = delete;
  Detector& operator=(const Detector&) = delete;

  /// All tags in the image. The list is empty if the image is too small to contain a tag. An image larger
  /// than the implementation can address results in a LimitExceeded error. Thread-safe.
  [[nodiscard]] virtual Result<std::vector<TagDetection>> detect(const ImageView& image) const = 0;

  /// The tags whose centres lie in one of the given rectangles of the image (clipped to it). The search
  /// extends a little beyond each rectangle, so the rectangle need not include the white margin of a tag. A
  /// tag found in two rectangles is reported once, with the better of its two readings. The cost is about
  /// proportional to the sum of the areas: overlapping rectangles are not merged.
  [[nodiscard]] virtual Result<std::vector<TagDetection>> detect(const ImageView& image,
                                                                 std::span<const PixelRect> regions) const;

 protected:
  Detector() = default;

 private:
  /// Cutting the image at multiples of this value [px] does not change how pixels are grouped.
  [[nodiscard]] virtual int region_alignment_px() const { return 1; }
};

/// Sorts by tag id, then by the position of the first corner (x, then y), then by decision margin in
/// descending order.
void sort_detections(std::vector<TagDetection>& detections);

/// Keeps the best of several overlapping detections of the same tag: the one with the fewest corrected bits,
/// then the largest decision margin, then the lowest position. Detections that do not overlap are different
/// prints of one tag, and all of them are kept. The result is sorted as by sort_detections(). O(n log n +
/// pairs of detections of the same tag).
void remove_duplicates(std::vector<TagDetection>& detections);

/// Selects the detector and its settings. The defaults were chosen on photographs and rendered images
/// (docs/concepts/detection.md).
struct DetectorOptions {
  std::string detector = "waymark";
  std::vector<std::string> families = {"tag36h11"};
  /// A conservative default. Correcting two bits instead of one finds 1.5 % more tags, but a random quad is
  /// then 18 times as likely to pass as a tag (docs/concepts/hamming.md; Martins and Ramos, "AprilTag-based
  /// Trajectory Tracking for the LIMOS Robot", section 2.3.1).
  int max_hamming = 1;
  double min_decision_margin = 0;
  bool find_inverted = false;
  double quad_decimate = 1;
  double quad_sigma = 0;
  bool refine_edges = true;
  double decode_sharpening = 0.8;
  int min_white_black_diff = 15;
  int memory_limit_mib = 512;
  /// Not a user setting: map tags that may be in view. The Waymark detector reads them with up to four wrong
  /// bits if the cell levels provide sufficient evidence. Tags of other families are ignored.
  std::vector<TagId> known_tags = {};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.detector, Field{"detector",
                               "Detector to use: waymark (this project's own), or apriltag3 (libapriltag "
                               "3.3.0: slower, with options that waymark does not have)."});
    visit(self.families,
          Field{"families", "Tag families to look for, e.g. tag36h11; each costs time and memory."});
    visit(
        self.max_hamming,
        Field{"max_hamming",
              "Maximum number of corrected bits of a tag, 0 to 2 (the limit of the library). Each additional "
              "bit finds slightly more tags and many more false ones.",
              0, 2});
    visit(self.min_decision_margin,
          Field{"min_decision_margin",
                "Minimum mean distance of the data bits from the black/white threshold, in grey levels after "
                "sharpening; raise it against false detections. Values of apriltag3 are two to three times "
                "as large, because it sharpens more.",
                0, 2000});
    visit(self.find_inverted,
          Field{"find_inverted",
                "Also find tags printed with black and white exchanged; detector waymark only. Doubles the "
                "time."});
    visit(self.quad_decimate, Field{"quad_decimate",
                                    "Downscaling of the image in which quads are searched, detector "
                                    "apriltag3: 1, 1.5 or an integer up to 8. 2 is "
                                    "two to four times as fast and loses tags with less than 3 px per bit.",
                                    1, 8});
    visit(self.quad_sigma,
          Field{"quad_sigma",
                "Standard deviation in pixels of a blur before the search for quads, detector "
                "apriltag3; about 0.8 for very noisy "
                "images. With quad_decimate 1 the bits are read from the blurred image too.",
                0, 2});
    visit(self.refine_edges, Field{"refine_edges",
                                   "Move each edge of a quad to the strongest gradient nearby, detector "
                                   "apriltag3 (the library's own "
                                   "refinement)."});
    visit(
        self.decode_sharpening,
        Field{
            "decode_sharpening",
            "Sharpening of the data bits before decoding, detector apriltag3; helps small and blurred tags.",
            0, 4});
    visit(self.min_white_black_diff,
          Field{"min_white_black_diff",
                "Minimum difference of black and white in grey levels; lower it for faint prints in the "
                "dark; this costs time if the image noise exceeds an eighth of it.",
                1, 255});
    visit(self.memory_limit_mib,
          Field{"memory_limit_mib",
                "Largest total size of the decoding tables of the detector apriltag3, in MiB.", 1, 16384});
  }
};

/// The families selected in the options, without duplicates. Fails if a family is unknown or the list is
/// empty.
[[nodiscard]] Result<std::vector<FamilyId>> chosen_families(const DetectorOptions& options);

}  // namespace waymark
