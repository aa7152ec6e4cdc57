#include "waymark/app/cli/localize_parts.hpp"

#include "waymark/app/common/report_fields.hpp"

namespace waymark::cli {

MethodFlags::MethodFlags(Settings& settings)
    : filter_(settings, "filter", "Filters"), anchor_(settings, "anchor", "Method anchor") {
  add_option(settings.app(), "--method NAME", method_,
             "Localisation method: riekf (right-invariant extended Kalman filter), ekf (extended Kalman "
             "filter), anchor (nearest tag and odometry) or smoother (riekf with a backward pass)",
             kShown);
}

Status MethodFlags::apply(LocalizationKind& method, RiekfOptions& filter, AnchorOptions& anchor) const {
  const Result<LocalizationKind> named = parse_localization_method(method_);
  if (!named) return tl::unexpected(named.error());
  method = *named;
  const char* hint = "Omit this option, or choose another --method.";
  Status status;
  if (method == LocalizationKind::Anchor)
    status = refuse(filter_, "the method anchor has no filter", hint);
  else
    status = refuse(anchor_, "this is an option of the method anchor", hint);
  if (status && method != LocalizationKind::Smoother)
    status = refuse(filter_, "this is an option of the method smoother", hint, "lag_s");
  if (status) status = filter_.apply(filter);
  if (status) status = anchor_.apply(anchor);
  return status;
}

ExitCode show_localized(const LocalizeReport& report, bool json, const std::vector<std::string>& warnings,
                        Console& console) {
  console.print(json ? json_line(fields(report)) : to_text(report));
  for (const std::string& warning : warnings) console.note("warning: " + warning);
  for (const std::string& problem : report.problems) console.note(problem);
  for (const std::string& warning : localization_warnings(report)) console.note(warning);
  return report.certain > 0 ? ExitCode::Ok : ExitCode::SomeFailed;
}

JobControl control_of_lines(Console& console) {
  JobControl control = control_from(console);
  control.cancelled = [&console] { return interrupted() || console.output_ended(); };
  return control;
}

}  // namespace waymark::cli
