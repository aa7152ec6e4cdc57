#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "waymark/camera/calibration_numbers.hpp"
#include "waymark/config/exchange/camera_file.hpp"
#include "waymark/config/yaml_tree.hpp"

/// Camera file formats and the parts they share, only for the readers in this folder. Writers are declared in
/// camera_file.hpp.
namespace waymark::internal {

/// Maximum side of an image in a camera file [px].
inline constexpr std::int64_t kLargestSide = 1'000'000;

/// A camera matrix as stored in files, row by row, with pixel centres at integers.
using FileIntrinsics = std::array<double, 9>;

/// Locations of a camera's values in the file, for errors from camera_from(), and the part of the image that
/// the camera sends.
struct CameraPlaces {
  YamlCursor intrinsics;
  YamlCursor resolution;
  YamlCursor distortion;
  ImagePart part;
};

/// The camera for a distortion model, whose name may be that of any format. `model` is the cursor at the
/// name.
[[nodiscard]] Result<CameraModel> make_camera(const YamlCursor& model, const FileIntrinsics& intrinsics,
                                              const std::vector<double>& distortion, std::int64_t width_px,
                                              std::int64_t height_px, const CameraPlaces& places);

/// fx, fy, cx, cy as stored in files; c_x and c_y are the shortest decimals that read back as the same value
/// after adding 1/2.
[[nodiscard]] std::array<std::string, 4> intrinsics_text(const CameraModel& camera);
/// The skew [px] of either model.
[[nodiscard]] double skew_of(const CameraModel& camera);
/// The coefficients in the order used in files.
[[nodiscard]] std::vector<double> file_distortion(const CameraModel& camera);

[[nodiscard]] bool looks_like_camera_info(const YamlCursor& root);
[[nodiscard]] Result<NamedCamera> read_camera_info(const YamlCursor& root);

[[nodiscard]] bool looks_like_photonvision(const YamlCursor& root);
[[nodiscard]] Result<NamedCamera> read_photonvision(const YamlCursor& root);

[[nodiscard]] bool looks_like_opencv(const YamlCursor& root);
[[nodiscard]] Result<NamedCamera> read_opencv(const YamlCursor& root);

/// The keys in a camchain that denote cameras.
[[nodiscard]] std::vector<std::string> camchain_names(const YamlCursor& root);
[[nodiscard]] Result<NamedCamera> read_camchain_camera(const YamlCursor& entry, std::string name);

}  // namespace waymark::internal
