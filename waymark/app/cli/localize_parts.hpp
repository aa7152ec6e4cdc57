#pragma once

#include <string>
#include <vector>

#include "waymark/app/cli/console.hpp"
#include "waymark/app/cli/flags.hpp"
#include "waymark/app/localize/localize_log.hpp"

/// Shared by the verbs of `waymark localize`.
namespace waymark::cli {

/// The flag --method and the options for each method. Must not move while the command line is parsed.
class MethodFlags {
 public:
  explicit MethodFlags(Settings& settings);

  /// Overwrites the method and the options of a job. Fails on an unknown method, and on options for a method
  /// that is not used.
  [[nodiscard]] Status apply(LocalizationKind& method, RiekfOptions& filter, AnchorOptions& anchor) const;
  /// Overwrites filter options read from a file with those set on the command line.
  [[nodiscard]] Status apply(RiekfOptions& filter) const { return filter_.apply(filter); }
  /// Whether filter options were set.
  [[nodiscard]] bool set_filter() const { return filter_.given(); }

 private:
  std::string method_ = "riekf";
  OptionFlags<RiekfOptions> filter_;
  OptionFlags<AnchorOptions> anchor_;
};

/// Prints the report and its warnings. Returns the exit code.
ExitCode show_localized(const LocalizeReport& report, bool json, const std::vector<std::string>& warnings,
                        Console& console);

/// Like control_from(), but also cancels the job once the reader of the output lines has closed the pipe.
[[nodiscard]] JobControl control_of_lines(Console& console);

}  // namespace waymark::cli
