#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "waymark/config/exchange/camera_file.hpp"
#include "waymark/config/yaml_tree.hpp"

/// The formats of camera files, and what they share; for the readers in this room only. What writes a format
/// is declared in camera_file.hpp.
namespace waymark::internal {

/// A side of an image in a camera file is no larger [px].
inline constexpr std::int64_t kLargestSide = 1'000'000;

/// Intrinsics as files have them: pixel centres at integers.
struct FileIntrinsics {
  double fx = 0, fy = 0, cx = 0, cy = 0;
};

/// Where the numbers of a camera stand, for the errors of CameraModel::make().
struct CameraPlaces {
  YamlCursor intrinsics;
  YamlCursor resolution;
  YamlCursor distortion;
};

/// The camera for a distortion model by its name in either format. `model` stands at its own cursor.
[[nodiscard]] Result<CameraModel> make_camera(const YamlCursor& model, const FileIntrinsics& intrinsics,
                                              const std::vector<double>& distortion, std::int64_t width_px,
                                              std::int64_t height_px, const CameraPlaces& places);

/// fx, fy, cx, cy as the files have them; c_x and c_y are the shortest that read back as the same after 1/2
/// is added.
[[nodiscard]] std::array<std::string, 4> intrinsics_text(const CameraModel& camera);
/// The coefficients in the order of the file.
[[nodiscard]] std::vector<double> file_distortion(const CameraModel& camera);

[[nodiscard]] bool looks_like_camera_info(const YamlCursor& root);
[[nodiscard]] Result<NamedCamera> read_camera_info(const YamlCursor& root);

[[nodiscard]] bool looks_like_photonvision(const YamlCursor& root);
[[nodiscard]] Result<NamedCamera> read_photonvision(const YamlCursor& root);

[[nodiscard]] bool looks_like_opencv(const YamlCursor& root);
[[nodiscard]] Result<NamedCamera> read_opencv(const YamlCursor& root);

/// The keys of a camchain that are cameras.
[[nodiscard]] std::vector<std::string> camchain_names(const YamlCursor& root);
[[nodiscard]] Result<NamedCamera> read_camchain_camera(const YamlCursor& entry, std::string name);

}  // namespace waymark::internal
