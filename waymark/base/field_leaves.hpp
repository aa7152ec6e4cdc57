#pragma once

#include <type_traits>

#include "waymark/base/fields.hpp"

namespace waymark {

/// Calls `visit(value, field)` for all fields of a struct and of the structs in it, in order; `enter(field)`
/// before those of a struct in it and `leave()` after.
template <HasFields Options, class Visit, class Enter, class Leave>
void visit_leaves(Options& options, const Visit& visit, const Enter& enter, const Leave& leave) {
  std::remove_const_t<Options>::fields(options, [&](auto& value, const Field& field) {
    if constexpr (HasFields<std::remove_cvref_t<decltype(value)>>) {
      enter(field);
      visit_leaves(value, visit, enter, leave);
      leave();
    } else {
      visit(value, field);
    }
  });
}

/// check_ranges() that also looks into the structs in a struct.
template <HasFields Options>
[[nodiscard]] Status check_leaf_ranges(const Options& options) {
  Status status = check_ranges(options);
  Options::fields(options, [&](const auto& value, const Field&) {
    if constexpr (HasFields<std::remove_cvref_t<decltype(value)>>)
      if (status) status = check_leaf_ranges(value);
  });
  return status;
}

}  // namespace waymark
