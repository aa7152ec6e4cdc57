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
constexpr const char* kHowToSet = "Write SECTION.KEY=VALUE; --help-all lists sections and keys.";

Place place_of(const std::string& argument) { return {.key = "--set " + argument}; }

/// "a.b=VALUE" as the map {a: {b: VALUE}}.
Result<YamlNode> parse_set(const std::string& argument) {
  const std::size_t equals = argument.find('=');
  const std::string path = argument.substr(0, equals);
  if (equals == std::string::npos || path.find('.') == std::string::npos)
    return fail(ErrorCode::InvalidArgument, "no section, key and value", place_of(argument), kHowToSet);
  Result<YamlNode> node = parse_yaml(argument.substr(equals + 1), "--set " + argument);
  if (!node) {
    Error error = node.error();
    error.place = place_of(argument);
    return tl::unexpected(std::move(error));
  }
  if (node->kind == YamlNode::Kind::Null)
    return fail(ErrorCode::InvalidArgument, "no value", place_of(argument), kHowToSet);
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

/// Whether the argument names the section, or the key of it: "follower", "filter.motion" or "filter.lag_s".
bool is_about(const std::string& argument, const std::string& path, bool whole) {
  const std::string name = argument.substr(0, argument.find('='));
  return name == path || (!whole && name.starts_with(path + "."));
}

/// Values that are neither maps nor lists of lists, as "path=VALUE".
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

void OptionLayers::add_section(const std::string& name, Check check) {
  sections_.push_back({name, std::move(check)});
}

std::vector<std::string> OptionLayers::section_names() const {
  std::vector<std::string> names;
  names.reserve(sections_.size());
  for (const Section& section : sections_) names.push_back(section.name);
  return names;
}

Status OptionLayers::load(const std::string& file, const std::vector<std::string>& sets) {
  layers_.clear();
  if (!file.empty()) {
    const Result<std::string> text = read_text_file(file, kLargestConfig);
    if (!text) return tl::unexpected(text.error());
    Result<YamlNode> root = parse_yaml(*text, file);
    if (!root) return tl::unexpected(root.error());
    layers_.push_back({std::move(*root), file});
  }
  for (const std::string& argument : sets) {
    Result<YamlNode> root = parse_set(argument);
    if (!root) return tl::unexpected(root.error());
    layers_.push_back({std::move(*root), "--set", argument});
  }
  for (const Layer& layer : layers_) {
    Status status = check(layer);
    if (!status && !layer.argument.empty()) status.error().place = place_of(layer.argument);
    if (!status) return status;
  }
  return {};
}

Status OptionLayers::check(const Layer& layer) const {
  const YamlCursor root(layer.root, layer.source);
  Status status = root.check_keys(section_names());
  if (!status && !layer.argument.empty())
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

std::string OptionLayers::first_set(const std::string& section, const std::string& key) const {
  const std::string path = key.empty() ? section : section + "." + key;
  for (const Layer& layer : layers_) {
    if (!layer.argument.empty() && is_about(layer.argument, path, !key.empty()))
      return "--set " + layer.argument;
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
