#pragma once

#include <set>
#include <string>
#include <string_view>

#include "waymark/config/yaml_tree.hpp"

namespace waymark {

/// Whether a text can be nothing but JSON: it begins with a brace.
[[nodiscard]] bool looks_like_json(std::string_view text);

/// A JSON document as the same tree that parse_yaml() makes. The values of the keys in `skipped` are checked
/// and passed over: they cost no memory. Fails on what is not JSON, on keys that are given twice, and beyond
/// the limits.
[[nodiscard]] Result<YamlNode> parse_json(std::string_view text, const std::string& source,
                                          const YamlLimits& limits = {},
                                          const std::set<std::string>& skipped = {});

}  // namespace waymark
