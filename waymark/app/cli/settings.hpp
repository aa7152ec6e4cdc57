#pragma once

#include <string>
#include <utility>
#include <vector>

#include "waymark/config/option_layers.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace waymark::cli {

/// The group of flags that only --help-all shows.
inline constexpr const char* kMoreGroup = "More";
/// The group of flags that --help shows.
inline constexpr const char* kFirstGroup = "Options";

/// A key that --set and --config take, and no flag does.
struct SettingOnlyKey {
  std::string key;       ///< "camera.exposure_ms"
  std::string usual;     ///< its default, as YAML
  std::string sentence;  ///< with its range
};

/// The options of a verb by their names: --config FILE.yaml and --set SECTION.KEY=VALUE, the layers below the
/// flags. What the sections do not have is refused while the command line is parsed, with its place. Must
/// stay where it is while the command line is parsed.
class Settings : public OptionLayers {
 public:
  explicit Settings(CLI::App& app);
  Settings(const Settings&) = delete;
  Settings& operator=(const Settings&) = delete;

  /// The verb whose options they are.
  [[nodiscard]] CLI::App& app() const { return app_; }
  /// For the help of --set; the first one counts.
  void name_example(const std::string& assignment);
  /// For --help-all.
  void add_key(SettingOnlyKey key) { keys_.push_back(std::move(key)); }

 private:
  [[nodiscard]] std::string keys_text() const;

  CLI::App& app_;
  CLI::Option* set_ = nullptr;
  bool named_example_ = false;
  std::string config_path_;
  std::vector<std::string> sets_;
  std::vector<SettingOnlyKey> keys_;
};

}  // namespace waymark::cli
