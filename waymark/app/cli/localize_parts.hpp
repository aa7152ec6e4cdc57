#pragma once

#include <string>
#include <vector>

#include "waymark/app/cli/console.hpp"
#include "waymark/app/cli/flags.hpp"
#include "waymark/app/localize/localize_log.hpp"

/// Shared by the verbs of `waymark localize`.
namespace waymark::cli {

/// The flag --method, and the options of the methods. Must not move while the command line is parsed.
class MethodFlags {
 public:
  explicit MethodFlags(Settings& settings);

  /// Overwrites method and options of a job. Fails on an unknown method, and on options of another method.
  [[nodiscard]] Status apply(LocalizationKind& method, RiekfOptions& filter, AnchorOptions& anchor) const;
  /// Overwrites filter options from a file with those that were given.
  [[nodiscard]] Status apply(RiekfOptions& filter) const { return filter_.apply(filter); }
  /// Whether filter options were given.
  [[nodiscard]] bool set_filter() const { return filter_.given(); }

 private:
  std::string method_ = "riekf";
  OptionFlags<RiekfOptions> filter_;
  OptionFlags<AnchorOptions> anchor_;
};

/// Prints the report and its warnings. Returns the exit code.
ExitCode show_localized(const LocalizeReport& report, bool json, const std::vector<std::string>& warnings,
                        Console& console);

/// Like control_from(), but also cancels if the reader of the output lines has closed the pipe.
[[nodiscard]] JobControl control_of_lines(Console& console);

}  // namespace waymark::cli
