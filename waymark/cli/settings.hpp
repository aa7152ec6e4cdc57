#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "waymark/config/yaml_fields.hpp"

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

/// The options of a verb by their names: --config FILE.yaml and --set SECTION.KEY=VALUE. Sections are the
/// option structs of the verb. A value of --set goes before one of the file, a flag before both. What the
/// sections do not know is refused while the command line is parsed, with its place. Must stay where it is
/// while the command line is parsed.
class Settings {
 public:
  /// Reads a section to see whether it can be read.
  using Check = std::function<Status(const YamlCursor&)>;

  explicit Settings(CLI::App& app);
  Settings(const Settings&) = delete;
  Settings& operator=(const Settings&) = delete;

  void add_section(const std::string& name, Check check);
  /// For the help of --set; the first one counts.
  void name_example(const std::string& assignment);
  /// For --help-all.
  void add_key(SettingOnlyKey key) { keys_.push_back(std::move(key)); }

  /// Whether the file or --set says something about a section, or about a key, such as "filter.lag_s".
  [[nodiscard]] bool given(const std::string& path) const;
  /// The first --set about the section, or about one key of it, as it was given; empty when there is none.
  [[nodiscard]] std::string first_set(const std::string& section, const std::string& key = {}) const;
  /// What the file and --set say about the section, as "section.key=VALUE", in the order in which it counts.
  [[nodiscard]] std::vector<std::string> assignments(const std::string& section) const;
  /// What the file and --set say about the section, over `options`. Cannot fail once the command line was
  /// parsed.
  template <HasFields Options>
  [[nodiscard]] Status read(const std::string& section, Options& options) const {
    Status status;
    for (const Layer& layer : layers_) {
      const auto found = YamlCursor(layer.root, layer.source).find(section);
      if (status && found) status = update_fields(*found, options);
    }
    return status;
  }

 private:
  /// The file, or one --set.
  struct Layer {
    YamlNode root;
    std::string source;
    std::string argument = {};  ///< "follower.reach_m=0.4"; empty: it is the file
  };
  struct Section {
    std::string name;
    Check check;
  };

  [[nodiscard]] Status load();
  [[nodiscard]] Status check(const Layer& layer) const;
  [[nodiscard]] std::string keys_text() const;

  CLI::Option* set_ = nullptr;
  bool named_example_ = false;
  std::string config_path_;
  std::vector<std::string> sets_;
  std::vector<Section> sections_;
  std::vector<SettingOnlyKey> keys_;
  std::vector<Layer> layers_;
};

}  // namespace waymark::cli
