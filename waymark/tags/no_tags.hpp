#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/image/image.hpp"
#include "waymark/tags/detector.hpp"

namespace waymark {

/// Why no tag was found in any image of a run, or in hardly any.
enum class NoTagCause : std::uint8_t {
  OtherFamily,  ///< the images contain tags of another family
  Mirrored,     ///< the mirrored images contain tags
  Inverted,     ///< the images contain tags with black and white exchanged
  Small,        ///< the images contain tags if they are enlarged
  Dark,         ///< nearly all pixels are black
  Bright,       ///< nearly all pixels are white
  Faint,        ///< the images use few grey levels
  Blurred,      ///< all edges are wider than about ten pixels
};

/// "other_family", "mirrored", …: the value of `no_tag_cause` in JSON.
[[nodiscard]] std::string_view to_string(NoTagCause cause);

/// A cause, and a message that states it and what to do.
struct NoTagReason {
  NoTagCause cause = NoTagCause::Dark;
  std::string message{};
};

/// Keeps a few images of a run in which no tag is found. If that is so in all images, reason() searches the
/// kept ones once for the cause. If a tag is found in at most one of twenty images, it searches them for tags
/// of other families. The cost is one copy of an image whenever the number of images without a tag is a power
/// of two.
class NoTagDiagnosis {
 public:
  /// Adds an image in which this number of tags was found.
  void add(const ImageView& image, std::size_t tags);
  /// `nullopt` if tags were found, if no image was added, or if the cause is unknown. `options` are those of
  /// the detector in the run.
  [[nodiscard]] std::optional<NoTagReason> reason(const DetectorOptions& options) const;

 private:
  static constexpr std::size_t kMaxKept = 3;
  static constexpr std::size_t kImagesPerTag = 20;  ///< if tags are seen in hardly any image
  /// Without a tag: the first image, and the last ones whose number is a power of two.
  std::vector<Image> kept_{};
  std::size_t without_ = 0;  ///< number of images without a tag
  std::size_t with_ = 0;
};

}  // namespace waymark
