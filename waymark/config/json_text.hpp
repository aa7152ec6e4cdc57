#pragma once

#include <set>
#include <string>
#include <string_view>

#include "waymark/config/yaml_tree.hpp"

namespace waymark {

/// Whether a text must be JSON because it begins with a brace.
[[nodiscard]] bool looks_like_json(std::string_view text);

/// Parses a JSON document into the same kind of tree as parse_yaml(). The values of the keys in `skipped` are
/// validated but not stored, so they cost no memory. Fails on invalid JSON, on duplicate keys, and if a limit
/// is exceeded.
[[nodiscard]] Result<YamlNode> parse_json(std::string_view text, const std::string& source,
                                          const YamlLimits& limits = {},
                                          const std::set<std::string>& skipped = {});

}  // namespace waymark
