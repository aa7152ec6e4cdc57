#include <nlohmann/json.hpp>

#include "waymark/app/video/map_video.hpp"

namespace waymark {

nlohmann::ordered_json to_json(const MapVideoReport& report) {
  const auto list = [](const Eigen::Vector3d& v) {
    return nlohmann::ordered_json::array({v.x(), v.y(), v.z()});
  };
  nlohmann::ordered_json tags = nlohmann::ordered_json::array();
  for (const auto& [id, tag] : report.file.tags.tags)
    tags.push_back({{"tag", to_string(id)},
                    {"map_t_tag_m", list(tag.map_T_tag.translation())},
                    {"sigma_m", list(position_sigma_m(tag))},
                    {"observations", report.file.observations.at(id)}});
  nlohmann::ordered_json beside = nlohmann::ordered_json::array();
  for (const TagBesidePrior& tag : report.beside)
    beside.push_back({{"tag", to_string(tag.tag)},
                      {"off_m", list(tag.off_m)},
                      {"sigma_m", list(tag.sigma_m)},
                      {"turned_rad", tag.turned_rad}});
  nlohmann::ordered_json distances = nlohmann::ordered_json::array();
  for (const MeasuredResidual& d : report.measured)
    distances.push_back({{"tags", {to_string(d.given.a), to_string(d.given.b)}},
                         {"measured_m", d.given.measured_m},
                         {"sigma_m", d.given.sigma_m},
                         {"found_m", d.found_m},
                         {"off_sigma", (d.found_m - d.given.measured_m) / d.given.sigma_m}});
  nlohmann::ordered_json intrinsics = nlohmann::ordered_json::object();
  for (const FoundIntrinsics& lens : report.map.intrinsics) {
    for (Eigen::Index i = 0; i < lens.found.size(); ++i)
      intrinsics[lens.names[static_cast<std::size_t>(i)]] = {{"given", lens.given[i]},
                                                             {"given_sigma", lens.prior_sigma[i]},
                                                             {"found", lens.found[i]},
                                                             {"sigma", lens.sigma[i]}};
  }
  return {{"pictures", report.pictures},
          {"pictures_with_pose", report.trajectory.size()},
          {"anchor", to_string(report.file.anchor)},
          {"tags", std::move(tags)},
          {"beside_prior", std::move(beside)},
          {"observations", report.map.observations.seen.size()},
          {"rejected_observations", report.map.rejected.size()},
          {"noise_px", report.map.noise_px},
          {"reprojection_mean_px", report.map.reprojection_mean_px},
          {"correlated_pictures", report.map.correlated_frames},
          {"corner_chi2_per_dof", report.corner_chi2_per_dof},
          {"size_scale", report.map.size_scale},
          {"size_scale_sigma", report.map.size_sigma},
          {"distances", std::move(distances)},
          {"intrinsics", std::move(intrinsics)},
          {"files", report.files},
          {"wall_s", report.wall_s},
          {"warnings", report.warnings}};
}

}  // namespace waymark
