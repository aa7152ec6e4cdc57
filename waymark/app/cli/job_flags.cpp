#include "waymark/app/cli/job_flags.hpp"

#include "waymark/app/cli/options_flags.hpp"

namespace waymark::cli {
namespace {

std::vector<std::string> parts_of(std::string_view text) {
  return text.empty() ? std::vector<std::string>() : CLI::detail::split(std::string(text), ',');
}

}  // namespace

std::string names_of(const JobField& field) {
  if (field.is_input) return std::string(field.value_name.substr(0, field.value_name.find(' ')));
  const std::string also = field.alias.empty() ? "" : "," + flag_name(field.alias);
  return (field.name == "output" ? "-o," : "") + flag_name(field.name) + also;
}

std::string type_of(const JobField& field) {
  if (!field.is_input) return std::string(field.value_name);
  const std::size_t space = field.value_name.find(' ');
  return space == std::string_view::npos ? "" : std::string(field.value_name.substr(space + 1));
}

void link(CLI::App& app, const JobField& field) {
  const auto option = [&app](std::string_view key) { return app.get_option(flag_name(key)); };
  for (const std::string& key : parts_of(field.needed)) option(field.name)->needs(option(key));
  for (const std::string& key : parts_of(field.excluded)) option(field.name)->excludes(option(key));
}

void arrange(CLI::Option& option, const JobField& field) {
  if (field.is_required) option.required();
  if (field.is_less) option.group(kMoreGroup);
  if (!field.group.empty()) option.group(std::string(field.group));
  if (!field.words.empty()) option.check(CLI::IsMember(parts_of(field.words)));
  if (!field.usual.empty()) option.default_str(std::string(field.usual));
  if (field.has_commas) option.delimiter(',');
  if (field.is_repeated) option.allow_extra_args(false);
  if (field.count > 0) option.expected(field.count);
}

}  // namespace waymark::cli
