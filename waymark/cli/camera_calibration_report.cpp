#include "waymark/cli/camera_calibration_report.hpp"

#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace waymark::cli {
namespace {

double sigma_of(const CameraCalibration& found, std::size_t parameter) {
  const auto k = static_cast<Eigen::Index>(parameter);
  return std::sqrt(std::max(0.0, found.covariance(k, k)));
}

std::string lenses_text(const CameraCalibration& found) {
  std::string text = "lens         pictures left out, RMS px\n";
  for (const LensTrial& trial : found.trials)
    text += fmt::format("{:<12} {}{}\n", to_string(trial.lens),
                        trial.held_out_rms_px ? fmt::format("{:.4f}", *trial.held_out_rms_px) : "no fit",
                        trial.lens == found.lens ? "   <- chosen" : "");
  return text;
}

std::string views_text(const CameraCalibration& found, const std::vector<std::string>& pictures) {
  std::string text = "  tags  left out    RMS px  tilt deg  distance m  picture\n";
  for (std::size_t i = 0; i < found.views.size(); ++i) {
    const CalibratedView& view = found.views[i];
    if (view.tags == 0) {
      text +=
          fmt::format("{:>6}{:>10}{:>10}{:>10}{:>12}  {}\n", 0, view.rejected, "-", "-", "-", pictures[i]);
    } else {
      text += fmt::format("{:>6}{:>10}{:>10.4f}{:>10.1f}{:>12.3f}  {}\n", view.tags, view.rejected,
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

std::string to_text(const CameraCalibration& found, const std::vector<std::string>& pictures) {
  std::string text;
  for (std::size_t i = 0; i < found.names.size(); ++i)
    text += fmt::format("{:<8}{:>14.6g} +- {:.2g}\n", found.names[i],
                        found.parameters[static_cast<Eigen::Index>(i)], sigma_of(found, i));
  text += fmt::format(
      "corners off by {:.4f} px RMS, {:.4f} px in pictures left out; {:.2f} times the noise they "
      "promised\n\n",
      found.rms_px, found.held_out_rms_px, found.noise_scale);
  if (found.trials.size() > 1) text += lenses_text(found) + "\n";
  text += views_text(found, pictures) + "\n" + regions_text(found);
  for (const std::string& words : found.advice) text += "\n" + words + "\n";
  return text;
}

nlohmann::ordered_json to_json(const CameraCalibration& found, const std::vector<std::string>& pictures) {
  nlohmann::ordered_json json = {{"lens", to_string(found.lens)},
                                 {"width_px", found.camera.width_px()},
                                 {"height_px", found.camera.height_px()},
                                 {"rms_px", found.rms_px},
                                 {"held_out_rms_px", found.held_out_rms_px},
                                 {"noise_scale", found.noise_scale}};
  for (std::size_t i = 0; i < found.names.size(); ++i)
    json["parameters"][found.names[i]] = {{"value", found.parameters[static_cast<Eigen::Index>(i)]},
                                          {"sigma", sigma_of(found, i)}};
  json["lenses"] = nlohmann::ordered_json::array();
  for (const LensTrial& trial : found.trials)
    json["lenses"].push_back(
        {{"lens", to_string(trial.lens)},
         {"held_out_rms_px", trial.held_out_rms_px ? nlohmann::ordered_json(*trial.held_out_rms_px)
                                                   : nlohmann::ordered_json(nullptr)}});
  json["pictures"] = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < found.views.size(); ++i) {
    const CalibratedView& view = found.views[i];
    json["pictures"].push_back({{"picture", pictures[i]},
                                {"tags", view.tags},
                                {"rejected", view.rejected},
                                {"rms_px", view.rms_px},
                                {"tilt_deg", view.tilt_deg},
                                {"distance_m", view.distance_m}});
  }
  json["regions"] = nlohmann::ordered_json::array();
  for (const ImageRegion& region : found.regions)
    json["regions"].push_back({{"corners", region.corners}, {"rms_px", region.rms_px}});
  json["advice"] = found.advice;
  return json;
}

}  // namespace waymark::cli
