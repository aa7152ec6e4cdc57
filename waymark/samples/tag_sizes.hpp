#pragma once

#include <map>
#include <optional>

#include "waymark/base/error.hpp"
#include "waymark/families/family.hpp"

namespace waymark {

/// How large the tags are: side of the square where black border meets white border [m]. One size for all,
/// others by id.
struct TagSizes {
  std::optional<double>
      default_size_m{};  ///< of every tag without a size of its own; nothing: such a tag is unknown
  std::map<TagId, double> size_by_tag_m{};  ///< tags printed in another size

  /// The size of one tag [m]. Fails when there is neither a size of its own nor a default, or when it is not
  /// a positive finite number. O(log n).
  [[nodiscard]] Result<double> size_m(const TagId& tag) const;
  /// Fails on the first size that is not a positive finite number. O(n).
  [[nodiscard]] Status check() const;

  friend bool operator==(const TagSizes&, const TagSizes&) = default;
};

/// A side of a tag [m] that can be: positive and finite.
[[nodiscard]] bool is_tag_size(double size_m);

}  // namespace waymark
