#include <cmath>
#include <filesystem>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "waymark/app/calibrate_camera/calibrate_camera.hpp"
#include "waymark/app/common/staged_folder.hpp"
#include "waymark/config/calibration_file.hpp"
#include "waymark/config/camera_file.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

/// PhotonVision writes JSON, the others YAML; whose YAML it is, the ending does not tell.
std::string format_of(const CalibrateCameraJob& job) {
  if (!job.format.empty()) return job.format;
  return job.output.ends_with(".json") ? "photonvision" : "waymark";
}

CameraObservation observation_of(const CalibrateCameraReport& report, std::size_t picture) {
  const CalibratedView& view = report.found.views[picture];
  const SE3 cam_T_target = view.target_T_cam.inverse();
  CameraObservation seen{.picture = report.pictures[picture], .cam_T_target = cam_T_target};
  for (std::size_t i = 0; i < view.used.size(); ++i) {
    const TargetMark& mark = report.marks[picture][i];
    for (std::size_t k = 0; k < mark.seen_px.size(); ++k) {
      const auto px = report.found.camera.project(cam_T_target * mark.target_points_m[k]);
      seen.target_points_m.push_back(mark.target_points_m[k]);
      seen.seen_px.push_back(mark.seen_px[k]);
      seen.errors_px.emplace_back(px ? Eigen::Vector2d(*px - mark.seen_px[k])
                                     : Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN()));
      seen.used.push_back(view.used[i]);
    }
  }
  return seen;
}

Result<std::string> text_as(const std::string& format, const NamedCamera& camera,
                            const CalibrateCameraReport& report) {
  if (format == "ros") return to_camera_info_yaml(camera);
  if (format == "kalibr") return to_camchain_yaml({camera});
  if (format == "opencv") return to_opencv_yaml(camera);
  std::vector<CameraObservation> observations;
  for (std::size_t i = 0; i < report.pictures.size(); ++i)
    if (!report.found.views[i].used.empty()) observations.push_back(observation_of(report, i));
  return to_photonvision_json(camera, observations);
}

Status write_as(const std::string& format, const std::string& path, const NamedCamera& camera,
                const CalibrateCameraReport& report) {
  const auto text = text_as(format, camera, report);
  return text ? write_text_file(path, *text) : Status(tl::unexpected(text.error()));
}

Status write_ours(const CalibrateCameraJob& job, const CalibrateCameraReport& report) {
  Calibration calibration = to_calibration(report.found);
  calibration.provenance.insert(calibration.provenance.begin(),
                                {"pictures", fmt::format("{}", report.pictures.size())});
  return write_calibration(job.output, calibration);
}

/// Whether the output can hold the lens: tried on a camera with it.
Status check_format_holds(const CalibrateCameraJob& job, LensModel lens) {
  if (job.output.empty() || format_of(job) == "waymark") return {};
  constexpr int kSide_px = 100;
  Eigen::VectorXd parameters = Eigen::VectorXd::Zero(std::ssize(parameter_names(lens)));
  parameters.head<4>().setConstant(kSide_px);
  const auto camera = camera_of(lens, parameters, kSide_px, kSide_px);
  if (!camera) return tl::unexpected(camera.error());
  const auto text =
      text_as(format_of(job), {.name = "cam0", .camera = *camera}, {.found = {.camera = *camera}});
  if (text) return {};
  return fail(ErrorCode::InvalidArgument, text.error().message, {.key = "--lens"}, text.error().hint);
}

/// The ending of the output must not promise another format.
Status check_ending(const CalibrateCameraJob& job) {
  const std::filesystem::path output(job.output);
  if (job.output.empty() || is_device(job.output)) return {};
  const std::string ending = output.extension().string();
  const bool yaml = ending == ".yaml" || ending == ".yml";
  const bool json = ending == ".json" && (job.format.empty() || job.format == "photonvision");
  if (json || (yaml && job.format != "photonvision")) return {};
  return fail(ErrorCode::InvalidArgument,
              fmt::format("{} is no name for a calibration{}", job.output,
                          job.format.empty() ? "" : " of the format " + job.format),
              {.key = "--output"}, "End it in .yaml, or in .json for PhotonVision.");
}

}  // namespace

const std::vector<std::string>& calibration_formats() {
  static const std::vector<std::string> all = {"waymark", "ros", "kalibr", "photonvision", "opencv"};
  return all;
}

Status check_outputs(const CalibrateCameraJob& job) {
  if (const Status fits = check_ending(job); !fits) return fits;
  if (const Status free =
          job.output.empty() || format_of(job) != "waymark" ? Status() : check_calibration_place(job.output);
      !free)
    return free;
  for (const std::string& output : {job.output, job.camera_info}) {
    if (const Status writable = output.empty() ? Status() : check_new_file(output, job.force); !writable)
      return writable;
  }
  const auto lens = lens_model(job.lens);
  return lens ? check_format_holds(job, *lens) : Status();
}

CameraCalibrationOptions fit_options(const CalibrateCameraJob& job) {
  CameraCalibrationOptions options = job.options;
  for (const LensModel lens : lens_models())
    if (check_format_holds(job, lens)) options.lenses.push_back(lens);
  return options;
}

std::string words_of_untried_lenses(const CalibrateCameraJob& job) {
  std::vector<std::string_view> untried;
  if (lens_model(job.lens)) return {};
  for (const LensModel lens : lens_models())
    if (!check_format_holds(job, lens)) untried.push_back(to_string(lens));
  if (untried.empty()) return {};
  return fmt::format("not tried, because the format {} does not hold it: --lens {}", format_of(job),
                     fmt::join(untried, ", "));
}

Status write_camera_calibration(const CalibrateCameraJob& job, const CalibrateCameraReport& report) {
  const NamedCamera camera{.name = "cam0", .camera = report.found.camera};
  if (!job.output.empty()) {
    const std::string format = format_of(job);
    if (Status written =
            format == "waymark" ? write_ours(job, report) : write_as(format, job.output, camera, report);
        !written)
      return written;
  }
  if (job.camera_info.empty()) return {};
  return write_text_file(job.camera_info,
                         to_camera_info_yaml({.name = "cam", .camera = report.found.camera}));
}

double sigma_of(const CameraCalibration& found, std::size_t parameter) {
  const auto k = static_cast<Eigen::Index>(parameter);
  return std::sqrt(std::max(0.0, found.covariance(k, k)));
}

nlohmann::ordered_json to_json(const CalibrateCameraReport& report) {
  const CameraCalibration& found = report.found;
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
    json["pictures"].push_back({{"picture", report.pictures[i]},
                                {report.marks_word, view.marks},
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

}  // namespace waymark
