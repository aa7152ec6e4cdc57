#include "waymark/app/cli/flags.hpp"

#include <filesystem>
#include <string>
#include <system_error>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/App.hpp>

#include "waymark/app/cli/help_text.hpp"
#include "waymark/app/common/output_files.hpp"

namespace waymark::cli {

Settings::Settings(CLI::App& app)
    : OptionLayers(
          {.name = "--set", .how_to_write = "Write SECTION.KEY=VALUE; --help-all lists sections and keys."}),
      app_(app) {
  app.add_option("--config", config_path_,
                 "YAML file with options by section and key, as for --set; --set and flags override it")
      ->type_name("FILE");
  set_ = app.add_option("--set", sets_, "Set one option by section and key (repeatable)")
             ->type_name("SECTION.KEY=VALUE")
             ->allow_extra_args(false);
  app.callback([this] {
    if (const Status loaded = load(config_path_, sets_); !loaded) throw SettingsError(loaded.error());
  });
  app.footer([this, &app]() -> std::string {
    const CLI::Option* all = app.get_help_all_ptr();
    return all != nullptr && all->count() > 0 ? keys_text() : std::string();
  });
}

void Settings::name_example(const std::string& assignment) {
  if (named_example_) return;
  named_example_ = true;
  set_->description(
      fmt::format("Set one option by section and key, for example {} (repeatable); --help-all lists them, "
                  "flags override it",
                  assignment));
}

std::string Settings::keys_text() const {
  std::string text =
      wrapped(fmt::format("Sections of --set and --config: {}. Each flag of a group that names a "
                          "section is a key of it, with _ for -.",
                          fmt::join(section_names(), ", ")),
              kHelpColumns) +
      "\n";
  if (keys_.empty()) return text;
  text += "\nKeys without a flag (--set, --config):\n";
  for (const SettingOnlyKey& key : keys_) text += help_line(key.key + "=" + key.usual, key.sentence);
  return text;
}

GivenFields given_on(const CLI::App& app) {
  return [&app](const char* flag) {
    const std::string name = std::string_view(flag).starts_with('-') ? flag : flag_name(flag);
    const CLI::Option* option = app.get_option_no_throw(name);
    return option != nullptr && option->count() > 0;
  };
}

namespace {

std::vector<std::string> parts_of(std::string_view text) {
  return text.empty() ? std::vector<std::string>() : CLI::detail::split(std::string(text), ',');
}

}  // namespace

void add_choice(CLI::App& app, const std::string& name) {
  app.add_flag_callback(
         name, [] {}, "Selects this verb in a command line that does not name it")
      ->group(kMoreGroup);
}

std::string names_of(const JobField& field) {
  const std::string also = field.alias.empty() ? "" : "," + flag_name(field.alias);
  if (field.is_input) return std::string(field.value_name.substr(0, field.value_name.find(' '))) + also;
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
  if (field.count > 0) exactly(field.count)(option);
}

CLI::Validator recording_name() {
  const auto complete = [](std::string& path) {
    const std::filesystem::path name(path);
    if (name.filename().empty()) return fmt::format("'{}' is not the name of a file", path);
    const std::string suffix = name.extension().string();
    if (suffix.empty() && !is_device(path)) path += ".mcap";
    if (suffix.empty() || suffix == ".mcap") return std::string();
    return fmt::format("{}: recordings are written as MCAP: use the extension .mcap, not {}", path, suffix);
  };
  return {complete, "", "recording"};
}

CLI::Validator yaml_name() {
  const auto check = [](std::string& path) {
    const std::string suffix = std::filesystem::path(path).extension().string();
    std::error_code ignored;
    const bool folder = std::filesystem::is_directory(path, ignored);
    if (suffix == ".yaml" || suffix == ".yml" || (is_device(path) && !folder)) return std::string();
    return fmt::format("{}: the output is YAML: use the extension .yaml", path);
  };
  return {check, "", "YAML"};
}

}  // namespace waymark::cli
