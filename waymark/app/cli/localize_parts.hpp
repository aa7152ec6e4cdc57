#pragma once

#include <string>
#include <vector>

#include "waymark/app/cli/console.hpp"
#include "waymark/app/cli/flags.hpp"
#include "waymark/app/localize/localize_log.hpp"

/// What the verbs of `waymark localize` share.
namespace waymark::cli {

/// The flag --method, and the options of the methods. Must stay where it is while the command line is parsed.
class MethodFlags {
 public:
  explicit MethodFlags(Settings& settings);

  /// Writes method and options over those of a job. Fails on an unknown method, and on options of another
  /// method.
  [[nodiscard]] Status apply(LocalizationKind& method, RiekfOptions& filter, AnchorOptions& anchor) const;
  /// Writes what was given over options of the filter that a file has.
  [[nodiscard]] Status apply(RiekfOptions& filter) const { return filter_.apply(filter); }
  /// Whether options of the filter were given.
  [[nodiscard]] bool set_filter() const { return filter_.given(); }

 private:
  std::string method_ = "riekf";
  OptionFlags<RiekfOptions> filter_;
  OptionFlags<AnchorOptions> anchor_;
};

/// Prints the report, the warnings and what is doubtful about it; its exit code.
ExitCode show_localized(const LocalizeReport& report, bool json, const std::vector<std::string>& warnings,
                        Console& console);

/// Ends also where nobody reads the lines any more.
[[nodiscard]] JobControl control_of_lines(Console& console);

}  // namespace waymark::cli
