#include <string>

#include <fmt/format.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "python/bindings/arrays.hpp"
#include "python/bindings/errors.hpp"
#include "python/bindings/options.hpp"
#include "python/bindings/packed.hpp"
#include "python/bindings/rooms.hpp"
#include "python/bindings/states.hpp"
#include "waymark/camera/intrinsics.hpp"
#include "waymark/pose/multi_tag_pose.hpp"
#include "waymark/pose/square_pose.hpp"
#include "waymark/pose/tag_pose.hpp"

namespace waymark::python {
namespace {

TagPose one_tag(const TagDetection& detection, double size_m, const CameraModel& camera,
                const py::kwargs& given) {
  py::dict options_given(given);
  const py::object covariance = take(options_given, "intrinsics_covariance");
  auto options = options_of<TagPoseOptions>(options_given);
  if (!covariance.is_none()) {
    const Eigen::Index n = intrinsics_of(camera).size();
    const Doubles numbers = doubles(covariance, "intrinsics_covariance", {n, n});
    options.intrinsics_covariance = Eigen::Map<const Eigen::MatrixXd>(numbers.data(), n, n);
  }
  return value_of(estimate_tag_pose(detection, size_m, camera, options));
}

MultiTagPose camera_pose(const std::vector<TagDetection>& detections, const TagMap& map,
                         const CameraModel& camera, const py::kwargs& given) {
  const auto options = options_of<MultiTagOptions>(given);
  const TagMap unchanging = map;  // another thread may change the original during the call
  Result<MultiTagPose> found;
  {
    const py::gil_scoped_release release;
    found = estimate_camera_pose(detections, unchanging, camera, options);
  }
  return value_of(std::move(found));
}

py::list closed_form(const py::object& bearings, double size_m) {
  const Eigen::Matrix<double, 4, 3> given = matrix_of<4, 3>(bearings, "cam_bearings");
  std::array<Eigen::Vector3d, 4> rays;
  for (int i = 0; i < 4; ++i) rays[static_cast<std::size_t>(i)] = given.row(i).transpose().normalized();
  if (!(size_m > 0 && size_m < 1e9))
    refuse("size_m", fmt::format("the size {} m is not positive", size_m),
           "Pass the side length of the tag in metres.");
  const SquarePoses poses = square_poses(rays, size_m);
  py::list answer;
  if (poses.defect != QuadDefect::None) refuse("cam_bearings", to_string(poses.defect));
  for (const SE3& cam_T_tag : poses.cam_T_tag) answer.append(cam_T_tag);
  return answer;
}

void bind_results(py::module_& m) {
  py::class_<TagPoseSolution> solution(
      m, "TagPoseSolution", "One pose that explains the corners: a minimum of the reprojection error.");
  solution.def_readonly("cam_T_tag", &TagPoseSolution::cam_T_tag, "SE3");
  solution.def_readonly("chi2", &TagPoseSolution::chi2,
                        "Sum of squared residuals divided by their variance; 2 degrees of freedom.");
  solution.def_readonly("rms_px", &TagPoseSolution::rms_px, "Root mean square distance of the corners [px].");
  solution.def_property_readonly(
      "covariance", [](const TagPoseSolution& s) { return to_array(s.covariance); },
      "(6, 6) in the camera frame's left tangent (translation, rotation) [m, rad]; contains sigma_scale.");
  solution.def_property_readonly(
      "lens_covariance", [](const TagPoseSolution& s) { return to_array(s.lens_covariance); },
      "(6, 6) the part of `covariance` from intrinsics_covariance; zero if the camera is taken as exact.");
  solution.def_readonly("sigma_scale", &TagPoseSolution::sigma_scale,
                        "Factor on the standard deviations, above 1 if chi2 is too large for chance.");
  def_state(solution);
  py::class_<TagPose> pose(m, "TagPose",
                           "Both pose candidates of a planar square. With noise, either may fit better.");
  pose.def_readonly("best", &TagPose::best, "The pose with the smaller chi2; not necessarily the true one.");
  pose.def_readonly("other", &TagPose::other,
                    "The pose with the larger chi2; None if there is no second minimum.");
  pose.def_property_readonly(
      "ambiguity_ratio", &TagPose::ambiguity_ratio,
      "best.rms_px / other.rms_px, 0 to 1. Near 1, the poses cannot be distinguished.");
  pose.def_property_readonly("likelihood_ratio", &TagPose::likelihood_ratio,
                             "Likelihood ratio of `other` to `best`, 0 to 1.");
  def_state(pose);
  py::class_<CameraPoseEstimate> estimate(m, "CameraPoseEstimate",
                                          "A pose of the camera that fits a set of tags.");
  estimate.def_readonly("map_T_cam", &CameraPoseEstimate::map_T_cam, "SE3");
  estimate.def_property_readonly(
      "covariance", [](const CameraPoseEstimate& e) { return to_array(e.covariance); },
      "(6, 6) in the map frame's left tangent (translation, rotation) [m, rad].");
  estimate.def_readonly("chi2", &CameraPoseEstimate::chi2, "8 residuals per tag, 6 unknowns.");
  estimate.def_readonly("rms_px", &CameraPoseEstimate::rms_px, "[px]");
  estimate.def_readonly("detections", &CameraPoseEstimate::detections, "Indices of the detections used.");
  def_state(estimate);
  py::class_<MultiTagPose> multi(m, "MultiTagPose", "Camera pose estimates from one image.");
  multi.def_readonly(
      "estimates", &MultiTagPose::estimates,
      "Best first. If there is more than one, the image does not determine which one is true.");
  multi.def_property_readonly(
      "rejected",
      [](const MultiTagPose& p) {
        py::list rejected;
        for (const RejectedTag& tag : p.rejected)
          rejected.append(py::make_tuple(tag.detection, to_string(tag.reason)));
        return rejected;
      },
      "(detection index, reason as text) for each detection that was not used.");
  multi.def_property_readonly("usable", &MultiTagPose::usable, "Whether there is an estimate.");
  multi.def_property_readonly("ambiguous", &MultiTagPose::ambiguous,
                              "Whether a second estimate fits the corners nearly as well.");
  def_packed(multi);
}

}  // namespace

void bind_pose(py::module_& m) {
  m.doc() = "Camera pose from tag corners, with covariance (docs/concepts/pose.md).";
  bind_results(m);
  m.def("estimate_tag_pose", &one_tag, py::arg("detection"), py::arg("size_m"), py::arg("camera"),
        ("Both poses of one tag. size_m: side of the square at the outer edge of the black border. Options "
         "by keyword:\n\n" +
         options_help<TagPoseOptions>() +
         "  intrinsics_covariance: covariance (n, n) of CameraModel.intrinsics, see "
         "read_intrinsics_covariance(); None: the camera is exact.\n")
            .c_str());
  m.def("estimate_camera_pose", &camera_pose, py::arg("detections"), py::arg("map"), py::arg("camera"),
        ("The camera pose in the map, from all tags in one image. Options by keyword:\n\n" +
         options_help<MultiTagOptions>())
            .c_str());
  m.def("square_poses", &closed_form, py::arg("cam_bearings"), py::arg("size_m"),
        "The two poses (SE3) of a square, from the directions (4, 3) to TL, TR, BR, BL in the camera frame. "
        "The method is infinitesimal plane-based pose estimation (Collins and Bartoli, IJCV 109, 2014).");
}

}  // namespace waymark::python
