// Calibrations as PhotonVision writes them: OpenCV's matrices as JSON, pixel centres at integers.
#include <algorithm>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/config/camera_formats.hpp"

namespace waymark::internal {
namespace {

constexpr std::int64_t kLargestImageSide = 1'000'000;

/// PhotonVision writes whole numbers as 1280.0.
Result<std::int64_t> side_of(const YamlCursor& cursor) {
  const Result<double> value = cursor.number();
  if (!value) return tl::unexpected(value.error());
  const auto side =
      static_cast<std::int64_t>(std::min(std::max(*value, 0.0), static_cast<double>(kLargestImageSide)));
  if (static_cast<double>(side) != *value || side == 0)
    return cursor.fail_here(ErrorCode::InvalidArgument, fmt::format("{} is no size in pixels", *value));
  return side;
}

/// An older PhotonVision called the distortion cameraExtrinsics.
Result<YamlCursor> distortion_of(const YamlCursor& root) {
  const auto older = root.find("cameraExtrinsics");
  return older && !root.find("distCoeffs") ? Result<YamlCursor>(*older) : root.at("distCoeffs");
}

Status check_lens(const YamlCursor& root) {
  const auto lens = root.find("lensmodel");
  if (!lens) return {};
  const Result<std::string> name = lens->text();
  if (!name) return tl::unexpected(name.error());
  if (*name == "LENSMODEL_OPENCV" || *name == "LENSMODEL_OPENCV5" || *name == "LENSMODEL_OPENCV8") return {};
  return lens->fail_here(ErrorCode::Unsupported, fmt::format("unknown lens model '{}'", name->substr(0, 40)),
                         "Known: LENSMODEL_OPENCV, LENSMODEL_OPENCV5, LENSMODEL_OPENCV8.");
}

}  // namespace

bool looks_like_photonvision(const YamlCursor& root) {
  return root.is_map() && root.find("cameraIntrinsics").has_value();
}

Result<NamedCamera> read_photonvision(const YamlCursor& root) {
  if (Status status = check_lens(root); !status) return tl::unexpected(status.error());
  const auto resolution = root.at("resolution");
  if (!resolution) return tl::unexpected(resolution.error());
  const auto width = resolution->read_at("width", side_of);
  if (!width) return tl::unexpected(width.error());
  const auto height = resolution->read_at("height", side_of);
  if (!height) return tl::unexpected(height.error());
  const auto matrix = root.read_at("cameraIntrinsics", [](const YamlCursor& c) { return c.at("data"); });
  if (!matrix) return tl::unexpected(matrix.error());
  const auto k = matrix->exactly_numbers(9);
  if (!k) return tl::unexpected(k.error());
  if ((*k)[1] != 0 || (*k)[3] != 0 || (*k)[6] != 0 || (*k)[7] != 0 || (*k)[8] != 1)
    return matrix->fail_here(ErrorCode::InvalidArgument, "not a camera matrix",
                             "Its rows are [fx, 0, cx], [0, fy, cy], [0, 0, 1].");
  const auto coefficients = distortion_of(root);
  if (!coefficients) return tl::unexpected(coefficients.error());
  const auto data = coefficients->at("data");
  if (!data) return tl::unexpected(data.error());
  const auto d = data->numbers();
  if (!d) return tl::unexpected(d.error());
  const YamlNode model{.kind = YamlNode::Kind::Scalar,
                       .line = data->place().line.value_or(1),
                       .text = d->size() > 5 ? "rational_polynomial" : "plumb_bob"};
  auto camera =
      make_camera(YamlCursor(model, root.source(), data->place().key), {(*k)[0], (*k)[4], (*k)[2], (*k)[5]},
                  *d, *width, *height, {*matrix, *resolution, *data});
  if (!camera) return tl::unexpected(camera.error());
  return NamedCamera{.name = "photonvision", .camera = *std::move(camera)};
}

}  // namespace waymark::internal

namespace waymark {
namespace {

using nlohmann::ordered_json;

ordered_json matrix(int rows, std::size_t cols, const std::vector<double>& data) {
  constexpr int kDouble = 6;  // CV_64F
  return {{"rows", rows}, {"cols", cols}, {"type", kDouble}, {"data", data}};
}

ordered_json point(const Eigen::Vector2d& p) { return {{"x", p.x()}, {"y", p.y()}}; }
ordered_json point(const Eigen::Vector3d& p) { return {{"x", p.x()}, {"y", p.y()}, {"z", p.z()}}; }

/// PhotonVision's observation, which has pixel centres at integers.
ordered_json to_json(const CameraObservation& seen) {
  ordered_json places = ordered_json::array();
  ordered_json pixels = ordered_json::array();
  ordered_json errors = ordered_json::array();
  for (std::size_t i = 0; i < seen.seen_px.size(); ++i) {
    places.push_back(point(seen.target_points_m[i]));
    pixels.push_back(point(Eigen::Vector2d(seen.seen_px[i].array() - 0.5)));
    errors.push_back(point(seen.errors_px[i]));  // what is not finite becomes null
  }
  const Eigen::Quaterniond q = seen.cam_T_target.rotation().quaternion();
  return {{"locationInObjectSpace", places},
          {"locationInImageSpace", pixels},
          {"reprojectionErrors", errors},
          {"optimisedCameraToObject",
           {{"translation", point(seen.cam_T_target.translation())},
            {"rotation", {{"quaternion", {{"W", q.w()}, {"X", q.x()}, {"Y", q.y()}, {"Z", q.z()}}}}}}},
          {"cornersUsed", seen.used},
          {"snapshotName", seen.picture}};
}

}  // namespace

Result<std::string> to_photonvision_json(const NamedCamera& named,
                                         const std::vector<CameraObservation>& observations) {
  const auto* radtan = std::get_if<PinholeRadtan>(&named.camera.projection());
  if (radtan == nullptr)
    return fail(ErrorCode::Unsupported, "PhotonVision has no equidistant lens", {},
                "Write it as opencv, ros or kalibr, or calibrate with --lens rational8.");
  std::vector<double> d = internal::file_distortion(named.camera);
  if (d.empty()) d.assign(5, 0.0);
  ordered_json json = {
      {"resolution", {{"width", named.camera.width_px()}, {"height", named.camera.height_px()}}},
      {"cameraIntrinsics",
       matrix(3, 3, {radtan->fx, 0, radtan->cx - 0.5, 0, radtan->fy, radtan->cy - 0.5, 0, 0, 1})},
      {"distCoeffs", matrix(1, d.size(), d)},
      {"calobjectWarp", ordered_json::array()},
      {"observations", ordered_json::array()},
      {"lensmodel", d.size() > 5 ? "LENSMODEL_OPENCV8" : "LENSMODEL_OPENCV"}};
  for (const CameraObservation& seen : observations) json["observations"].push_back(to_json(seen));
  return json.dump() + "\n";
}

}  // namespace waymark
