#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/families/family.hpp"

namespace waymark {

/// Tag sizes [m], measured as the side of the square where the black border meets the white border. There is
/// one default size, and other sizes are given by id.
struct TagSizes {
  std::optional<double>
      default_size_m{};  ///< for tags not in size_by_tag_m; if empty, the size of such tags is unknown
  std::map<TagId, double> size_by_tag_m{};  ///< tags printed at a different size

  /// The size of one tag [m]. Fails if neither its own size nor a default is given, or if the size is not
  /// positive and finite. O(log n).
  [[nodiscard]] Result<double> size_m(const TagId& tag) const;
  /// Fails on the first size that is not a positive finite number. O(n).
  [[nodiscard]] Status check() const;
  /// One warning for each unusual size, below 5 mm or above 1 m. O(n).
  [[nodiscard]] std::vector<std::string> warnings() const;

  friend bool operator==(const TagSizes&, const TagSizes&) = default;
};

/// Limits for the side of a printed tag [m] that a user enters; values outside them were probably entered in
/// centimetres or millimetres.
inline constexpr double kMinTagSize_m = 0.001;
inline constexpr double kMaxTagSize_m = 10;

/// Whether a tag's side length [m] is valid, i.e. positive and finite.
[[nodiscard]] bool is_tag_size(double size_m);

/// What a size beyond these limits probably means, as a sentence after another one, such as " 16 cm are 0.16
/// m."; empty for other sizes.
[[nodiscard]] std::string size_in_metres(double size_m);

/// Fails if a size is outside these limits. Errors name the field `key`, and what the size probably means.
[[nodiscard]] Status check_printed_size(double size_m, std::string key);

}  // namespace waymark
