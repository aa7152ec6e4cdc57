#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/config/yaml_fields.hpp"

namespace waymark {

/// How errors refer to assignments.
struct AssignmentSource {
  std::string name{};  ///< prefix of the assignment in errors; may be empty
  std::string how_to_write = "Write SECTION.KEY=VALUE.";  ///< hint for an invalid assignment
};

/// Options by section and key, in layers: first a YAML file, then assignments "SECTION.KEY=VALUE", each of
/// which overrides earlier layers. A section is an option struct.
class OptionLayers {
 public:
  /// Reads a section to check that it is valid.
  using Check = std::function<Status(const YamlCursor&)>;

  explicit OptionLayers(AssignmentSource assignments = {});
  void add_section(const std::string& name, Check check);
  /// Loads the layers; an empty `file` means that there is none. Fails, reporting the place, on unknown
  /// sections and keys and on invalid values.
  [[nodiscard]] Status load(const std::string& file, const std::vector<std::string>& assignments);

  /// Whether a layer sets a section or a key, such as "filter.lag_s".
  [[nodiscard]] bool given(const std::string& path) const;
  /// The first assignment to the section or to one of its keys, with the prefix of its source. Empty if there
  /// is no such assignment.
  [[nodiscard]] std::string first_assignment(const std::string& section, const std::string& key = {}) const;
  /// The values that all layers set in the section, as assignments in order of precedence.
  [[nodiscard]] std::vector<std::string> assignments(const std::string& section) const;
  /// Applies all layers of the section to `options`. Cannot fail after load().
  template <HasFields Options>
  [[nodiscard]] Status read(const std::string& section, Options& options) const {
    Status status;
    for (const Layer& layer : layers_) {
      const auto found = YamlCursor(layer.root, layer.source).find(section);
      if (status && found) status = update_fields(*found, options);
    }
    return status;
  }
  [[nodiscard]] std::vector<std::string> section_names() const;

 private:
  /// The file, or one assignment.
  struct Layer {
    YamlNode root;
    std::string source;
    std::string assignment = {};  ///< "follower.reach_m=0.4"; empty for the file
  };
  struct Section {
    std::string name;
    Check check;
  };

  [[nodiscard]] Status check(const Layer& layer) const;
  /// The assignment with the prefix of its source.
  [[nodiscard]] std::string with_source(const std::string& assignment) const;

  AssignmentSource assignments_;
  std::vector<Section> sections_;
  std::vector<Layer> layers_;
};

}  // namespace waymark
