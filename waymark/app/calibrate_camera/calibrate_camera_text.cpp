#include "waymark/app/calibrate_camera/calibrate_camera_text.hpp"

#include <fmt/format.h>

namespace waymark {
namespace {

std::string lenses_text(const CameraCalibration& found) {
  std::string text = "lens         pictures left out, RMS px\n";
  for (const LensTrial& trial : found.trials)
    text += fmt::format("{:<12} {}{}\n", to_string(trial.lens),
                        trial.held_out_rms_px ? fmt::format("{:.4f}", *trial.held_out_rms_px) : "no fit",
                        trial.lens == found.lens ? "   <- chosen" : "");
  return text;
}

std::string views_text(const CalibrateCameraReport& report) {
  const CameraCalibration& found = report.found;
  const std::vector<std::string>& pictures = report.pictures;
  std::string text = fmt::format("{:>7}{:>9}{:>10}{:>10}{:>12}  picture\n", report.marks_word, "left out",
                                 "RMS px", "tilt deg", "distance m");
  for (std::size_t i = 0; i < found.views.size(); ++i) {
    const CalibratedView& view = found.views[i];
    if (view.marks == 0) {
      text += fmt::format("{:>7}{:>9}{:>10}{:>10}{:>12}  {}\n", 0, view.rejected, "-", "-", "-", pictures[i]);
    } else {
      text += fmt::format("{:>7}{:>9}{:>10.4f}{:>10.1f}{:>12.3f}  {}\n", view.marks, view.rejected,
                          view.rms_px, view.tilt_deg, view.distance_m, pictures[i]);
    }
  }
  return text;
}

std::string regions_text(const CameraCalibration& found) {
  std::string text = "by part of the image: RMS px (corners)\n";
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      const ImageRegion& region = found.regions[3 * row + column];
      text += fmt::format(
          "{:>18}", region.corners == 0 ? "-" : fmt::format("{:.4f} ({})", region.rms_px, region.corners));
    }
    text += "\n";
  }
  return text;
}

}  // namespace

std::string to_text(const CalibrateCameraReport& report) {
  const CameraCalibration& found = report.found;
  std::string text;
  for (std::size_t i = 0; i < found.names.size(); ++i)
    text += fmt::format("{:<8}{:>14.6g} +- {:.2g}\n", found.names[i],
                        found.parameters[static_cast<Eigen::Index>(i)], sigma_of(found, i));
  text += fmt::format(
      "corners off by {:.4f} px RMS, {:.4f} px in pictures left out; {:.2f} times the noise they "
      "promised\n\n",
      found.rms_px, found.held_out_rms_px, found.noise_scale);
  if (found.trials.size() > 1) text += lenses_text(found) + "\n";
  text += views_text(report) + "\n" + regions_text(found);
  for (const std::string& words : found.advice) text += "\n" + words + "\n";
  return text;
}

}  // namespace waymark
