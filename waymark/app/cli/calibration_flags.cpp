#include "waymark/app/cli/calibration_flags.hpp"

#include "waymark/app/common/report_fields.hpp"

namespace waymark::cli {

Result<CalibrationTarget> usable_target(const TargetOptions& target, const CameraFitJob& fit) {
  auto made = CalibrationTarget::make(target);
  if (!made) return made;
  if (const Status writable = check_outputs(fit); !writable) return tl::unexpected(writable.error());
  return made;
}

ExitCode print_and_write(const Result<CalibrateCameraReport>& report, const CameraFitJob& fit, bool json,
                         Console& console) {
  if (!report) return fail_with(report.error(), console);
  console.print(json ? json_line(fields(*report)) : to_text(*report));
  const Status written = write_camera_calibration(fit, *report);
  return written ? ExitCode::Ok : fail_with(written.error(), console);
}

}  // namespace waymark::cli
