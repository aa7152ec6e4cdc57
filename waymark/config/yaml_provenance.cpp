#include "waymark/config/yaml_provenance.hpp"

#include <fmt/format.h>

#include "waymark/config/yaml_write.hpp"

namespace waymark::internal {

Result<Provenance> read_provenance(const YamlCursor& root) {
  Provenance provenance;
  const auto entry = root.find("provenance");
  if (!entry) return provenance;
  if (!entry->is_map()) return entry->fail_here(ErrorCode::InvalidArgument, "is not a map (key: value)");
  const std::vector<YamlCursor> values = entry->children();
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Result<std::string> text = values[i].text();
    if (!text) return tl::unexpected(text.error());
    provenance.emplace_back(entry->node().keys[i], *text);
  }
  return provenance;
}

std::string provenance_yaml(const Provenance& provenance) {
  std::string text = provenance.empty() ? "provenance: {}\n" : "provenance:\n";
  for (const auto& [key, value] : provenance)
    text += fmt::format("  {}: {}\n", yaml_text(key), yaml_text(value));
  return text;
}

}  // namespace waymark::internal
