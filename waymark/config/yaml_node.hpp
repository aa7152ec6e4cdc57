#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"

namespace waymark {

/// One value of a YAML document: plain data with the line it stands on.
struct YamlNode {
  enum class Kind : std::uint8_t { Null, Scalar, Sequence, Map };

  Kind kind = Kind::Null;
  std::int64_t line = 1;                     ///< 1-based
  std::string text = {};                     ///< of a scalar, unquoted
  std::vector<std::string> keys = {};        ///< of a map, in the order of the file
  std::vector<std::int64_t> key_lines = {};  ///< where they stand
  std::vector<YamlNode> items = {};          ///< of a sequence, or the values of a map (as many as keys)
};

/// What a document may grow to: beyond it is an error and not a full memory or an overflowing stack.
struct YamlLimits {
  std::size_t bytes = std::size_t{1} << 20U;
  std::size_t nodes = 100'000;
  std::size_t depth = 64;
};

/// The single document in the text; `source` names it in errors. Fails on what is not YAML, on keys that are
/// given twice or are not words, on anchors and aliases (Unsupported: they can multiply a small file without
/// bound), on a second document that is not empty, and beyond the limits. O(bytes · log keys).
[[nodiscard]] Result<YamlNode> parse_yaml(std::string_view text, const std::string& source,
                                          const YamlLimits& limits = {});

}  // namespace waymark
