#pragma once

#include <map>
#include <optional>

#include "waymark/base/error.hpp"
#include "waymark/families/family.hpp"

namespace waymark {

/// Tag sizes, measured as the side of the square where black border meets white border [m]. One default size,
/// and others by id.
struct TagSizes {
  std::optional<double>
      default_size_m{};  ///< for tags not in size_by_tag_m; nothing: the size of such a tag is unknown
  std::map<TagId, double> size_by_tag_m{};  ///< tags printed in a different size

  /// The size of one tag [m]. Fails if it has neither its own size nor a default, or if the size is not
  /// positive and finite. O(log n).
  [[nodiscard]] Result<double> size_m(const TagId& tag) const;
  /// Fails on the first size that is not a positive finite number. O(n).
  [[nodiscard]] Status check() const;

  friend bool operator==(const TagSizes&, const TagSizes&) = default;
};

/// Whether the side of a tag [m] is valid: positive and finite.
[[nodiscard]] bool is_tag_size(double size_m);

}  // namespace waymark
