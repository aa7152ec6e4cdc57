#include "waymark/app/cli/settings.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/App.hpp>

#include "waymark/app/cli/help_text.hpp"

namespace waymark::cli {

Settings::Settings(CLI::App& app) : app_(app) {
  app.add_option(
         "--config", config_path_,
         "YAML file with options by section and key, as --set names them; --set and flags override it")
      ->type_name("FILE");
  set_ = app.add_option("--set", sets_, "Set one option by section and key (repeatable)")
             ->type_name("SECTION.KEY=VALUE")
             ->allow_extra_args(false);
  app.callback([this] {
    if (const Status loaded = load(config_path_, sets_); !loaded)
      throw CLI::ValidationError(to_string(loaded.error()));
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

}  // namespace waymark::cli
