#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/config/yaml_fields.hpp"

namespace waymark {

/// How errors name what assignments were given by.
struct AssignmentSource {
  std::string name{};  ///< stands before the assignment; empty: nothing does
  std::string how_to_write = "Write SECTION.KEY=VALUE.";  ///< the hint for what is no assignment
};

/// Options by section and key, said in layers: a YAML file, then assignments "SECTION.KEY=VALUE", each of
/// which counts more than what comes before it. A section is an option struct.
class OptionLayers {
 public:
  /// Reads a section to see whether it can be read.
  using Check = std::function<Status(const YamlCursor&)>;

  explicit OptionLayers(AssignmentSource assignments = {});
  void add_section(const std::string& name, Check check);
  /// `file`: empty: none. Fails on what the sections do not have, and on values that are none, with their
  /// place.
  [[nodiscard]] Status load(const std::string& file, const std::vector<std::string>& assignments);

  /// Whether a layer says something about a section, or about a key, such as "filter.lag_s".
  [[nodiscard]] bool given(const std::string& path) const;
  /// The first assignment about the section, or about one key of it, after the name of its source; empty when
  /// there is none.
  [[nodiscard]] std::string first_assignment(const std::string& section, const std::string& key = {}) const;
  /// What all layers say about the section, as assignments, in the order in which they count.
  [[nodiscard]] std::vector<std::string> assignments(const std::string& section) const;
  /// What all layers say about the section, over `options`. Cannot fail after load().
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
    std::string assignment = {};  ///< "follower.reach_m=0.4"; empty: it is the file
  };
  struct Section {
    std::string name;
    Check check;
  };

  [[nodiscard]] Status check(const Layer& layer) const;
  /// The assignment after the name of its source.
  [[nodiscard]] std::string said(const std::string& assignment) const;

  AssignmentSource assignments_;
  std::vector<Section> sections_;
  std::vector<Layer> layers_;
};

}  // namespace waymark
