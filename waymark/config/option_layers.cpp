#include "waymark/config/option_layers.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

constexpr std::size_t kLargestConfig = std::size_t{1} << 20U;

/// Parses "a.b=VALUE" as the map {a: {b: VALUE}}. Errors have no place.
Result<YamlNode> parse_assignment(const std::string& assignment, const std::string& how_to_write) {
  const std::size_t equals = assignment.find('=');
  const std::string path = assignment.substr(0, equals);
  if (equals == std::string::npos || path.find('.') == std::string::npos)
    return fail(ErrorCode::InvalidArgument, "not of the form SECTION.KEY=VALUE", {}, how_to_write);
  Result<YamlNode> node = parse_yaml(assignment.substr(equals + 1), assignment);
  if (!node) return node;
  if (node->kind == YamlNode::Kind::Null)
    return fail(ErrorCode::InvalidArgument, "no value", {}, how_to_write);
  std::string rest = path;
  while (true) {
    const std::size_t dot = rest.rfind('.');
    YamlNode outer{.kind = YamlNode::Kind::Map};
    outer.keys = {dot == std::string::npos ? rest : rest.substr(dot + 1)};
    outer.key_lines = {1};
    outer.items.push_back(std::move(*node));
    *node = std::move(outer);
    if (dot == std::string::npos) return node;
    rest.resize(dot);
  }
}

/// Whether the assignment sets the section or key `path`: "follower", "filter.motion" or "filter.lag_s".
bool is_about(const std::string& assignment, const std::string& path, bool whole) {
  const std::string name = assignment.substr(0, assignment.find('='));
  return name == path || (!whole && name.starts_with(path + "."));
}

/// Appends values, except maps and lists of lists, as "path=VALUE".
void add_assignments(const YamlNode& node, const std::string& path, std::vector<std::string>& out) {
  if (node.kind == YamlNode::Kind::Map) {
    for (std::size_t i = 0; i < node.keys.size(); ++i)
      add_assignments(node.items[i], path + "." + node.keys[i], out);
  } else if (node.kind == YamlNode::Kind::Sequence) {
    std::vector<std::string> items;
    for (const YamlNode& item : node.items) items.push_back(yaml_text(item.text));
    out.push_back(fmt::format("{}=[{}]", path, fmt::join(items, ", ")));
  } else if (node.kind == YamlNode::Kind::Scalar) {
    out.push_back(path + "=" + yaml_text(node.text));
  }
}

}  // namespace

OptionLayers::OptionLayers(AssignmentSource assignments) : assignments_(std::move(assignments)) {}

void OptionLayers::add_section(const std::string& name, Check check) {
  sections_.push_back({name, std::move(check)});
}

std::vector<std::string> OptionLayers::section_names() const {
  std::vector<std::string> names;
  names.reserve(sections_.size());
  for (const Section& section : sections_) names.push_back(section.name);
  return names;
}

std::string OptionLayers::with_source(const std::string& assignment) const {
  return assignments_.name.empty() ? assignment : assignments_.name + " " + assignment;
}

Status OptionLayers::load(const std::string& file, const std::vector<std::string>& assignments) {
  layers_.clear();
  if (!file.empty()) {
    const Result<std::string> text = read_text_file(file, kLargestConfig);
    if (!text) return tl::unexpected(text.error());
    Result<YamlNode> root = parse_yaml(*text, file);
    if (!root) return tl::unexpected(root.error());
    layers_.push_back({std::move(*root), file});
  }
  for (const std::string& assignment : assignments) {
    Result<YamlNode> root = parse_assignment(assignment, assignments_.how_to_write);
    if (!root) {
      root.error().place = {.key = with_source(assignment)};
      return tl::unexpected(root.error());
    }
    layers_.push_back({std::move(*root), assignments_.name, assignment});
  }
  for (const Layer& layer : layers_) {
    Status status = check(layer);
    if (!status && !layer.assignment.empty()) status.error().place = {.key = with_source(layer.assignment)};
    if (!status) return status;
  }
  return {};
}

Status OptionLayers::check(const Layer& layer) const {
  const YamlCursor root(layer.root, layer.source);
  Status status = root.check_keys(section_names());
  if (!status && !layer.assignment.empty())
    status.error().message = fmt::format("unknown section '{}'", layer.root.keys.front());
  for (const Section& section : sections_) {
    const auto found = root.find(section.name);
    if (status && found) status = section.check(*found);
  }
  return status;
}

bool OptionLayers::given(const std::string& path) const {
  return std::ranges::any_of(layers_, [&](const Layer& layer) {
    std::optional<YamlCursor> found = YamlCursor(layer.root, layer.source);
    std::string_view rest = path;
    while (found && !rest.empty()) {
      const std::size_t dot = rest.find('.');
      found = found->find(rest.substr(0, dot));
      rest.remove_prefix(dot == std::string_view::npos ? rest.size() : dot + 1);
    }
    return found.has_value();
  });
}

std::string OptionLayers::first_assignment(const std::string& section, const std::string& key) const {
  const std::string path = key.empty() ? section : section + "." + key;
  for (const Layer& layer : layers_) {
    if (!layer.assignment.empty() && is_about(layer.assignment, path, !key.empty()))
      return with_source(layer.assignment);
  }
  return {};
}

std::vector<std::string> OptionLayers::assignments(const std::string& section) const {
  std::vector<std::string> found;
  for (const Layer& layer : layers_) {
    const auto value = YamlCursor(layer.root, layer.source).find(section);
    if (value) add_assignments(value->node(), section, found);
  }
  return found;
}

}  // namespace waymark
