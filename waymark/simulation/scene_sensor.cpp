#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "waymark/simulation/counter_noise.hpp"
#include "waymark/simulation/row_major.hpp"
#include "waymark/simulation/scene_exposure.hpp"

namespace waymark::render {
namespace {

constexpr int kLevels = 256;

/// Weights of pixels -reach .. reach with exactly the variance asked: a sampled Gaussian of another width,
/// found by bisection.
std::vector<float> lens_weights(double sigma_px) {
  if (sigma_px < 0.05) return {1.0F};
  const int reach = std::max(1, static_cast<int>(std::ceil(4 * sigma_px)));
  std::vector<double> weights(static_cast<std::size_t>(2 * reach + 1));
  const auto variance_of = [&](double sigma) {
    double sum = 0;
    double squares = 0;
    for (int k = -reach; k <= reach; ++k) {
      const double w = std::exp(-k * k / (2 * sigma * sigma));
      weights[row_major(k + reach, 1)] = w;
      sum += w;
      squares += w * k * k;
    }
    for (double& w : weights) w /= sum;
    return squares / sum;
  };
  double low = 0.05;
  double high = 4 * sigma_px + 1;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (variance_of(middle) < sigma_px * sigma_px ? low : high) = middle;
  }
  return {weights.begin(), weights.end()};
}

/// Light of the lamps while a row is exposed, relative: the mean of two oscillations over the exposure.
double lamp_light(const SceneCameraOptions& options, double time_s) {
  const auto swing = [&](double frequency_hz) {
    const double half_turn = std::numbers::pi * frequency_hz * options.exposure_ms * 1e-3;
    const double kept = half_turn > 1e-9 ? std::sin(half_turn) / half_turn : 1;
    const double turns = frequency_hz * time_s;
    return kept * std::sin(2 * std::numbers::pi * (turns - std::floor(turns)));
  };
  return 1 + options.flicker * swing(options.flicker_hz) + options.drift * swing(1 / options.drift_period_s);
}

/// Row y of the light, spread down columns: what lies beyond the picture is as its rim.
void spread_down(const SceneCamera::Parts& parts, const SceneExposure& exposure, int y,
                 std::vector<float>& out) {
  const int reach = static_cast<int>(parts.lens.size() / 2);
  const int height = parts.rays->height_px();
  const auto width = static_cast<std::size_t>(parts.rays->width_px());
  std::fill(out.begin(), out.end(), 0.0F);
  for (int k = -reach; k <= reach; ++k) {
    const int from = std::clamp(y + k, 0, height - 1);
    const float* light = exposure.light.data() + static_cast<std::size_t>(from) * width;
    const float weight = parts.lens[row_major(k + reach, 1)];
    float* to = out.data() + reach;
    for (std::size_t x = 0; x < width; ++x) to[x] += weight * light[x];
  }
  for (int k = 0; k < reach; ++k) {
    out[static_cast<std::size_t>(k)] = out[static_cast<std::size_t>(reach)];
    out[width + static_cast<std::size_t>(reach + k)] = out[width + static_cast<std::size_t>(reach) - 1];
  }
}

/// Scratch of one band.
struct Rows {
  std::vector<float> spread, level, noise;
};

void spread_along(const std::vector<float>& weights, const std::vector<float>& from, std::vector<float>& to) {
  std::fill(to.begin(), to.end(), 0.0F);
  for (std::size_t k = 0; k < weights.size(); ++k) {
    const float weight = weights[k];
    const float* source = from.data() + k;
    float* sum = to.data();
    for (std::size_t x = 0; x < to.size(); ++x) sum[x] += weight * source[x];
  }
}

/// Adds noise to linear grey levels: variance read^2 + level x gain, gain = 255 / full well (EMVA Standard
/// 1288, release 4, equation 9; shot noise as a normal distribution).
void add_noise(const SceneCamera::Parts& parts, const SceneExposure& exposure, int y, Rows& rows) {
  const SceneCameraOptions& options = parts.options;
  if (options.full_well_electrons <= 0) return;
  const auto gain = static_cast<float>(255 / options.full_well_electrons);
  const auto read = static_cast<float>(options.read_noise_electrons) * gain;
  const std::size_t width = rows.level.size();
  const std::uint64_t first = static_cast<std::uint64_t>(y) * (width + width % 2);
  normals(exposure.seed, first, static_cast<int>(width), rows.noise.data());
  float* level = rows.level.data();
  const float* noise = rows.noise.data();
  for (std::size_t x = 0; x < width; ++x)
    level[x] += noise[x] * std::sqrt(read * read + gain * std::max(level[x], 0.0F));
}

void write_row(const SceneCamera::Parts& parts, const std::vector<float>& level, std::uint8_t* out) {
  if (parts.tone.empty()) {
    for (std::size_t x = 0; x < level.size(); ++x) {
      const float up =
          0.5F + std::min(std::max(level[x], 0.0F), 255.0F);  // rounds; lround is ten times as slow
      out[x] = static_cast<std::uint8_t>(up);
    }
    return;
  }
  const auto last = static_cast<float>(parts.tone.size() - 1);
  for (std::size_t x = 0; x < level.size(); ++x) {
    const float step = std::min(std::max(level[x] * kToneSteps + 0.5F, 0.0F), last);
    out[x] = parts.tone[static_cast<std::size_t>(step)];
  }
}

}  // namespace

double row_time_s(const SceneCamera::Parts& parts, double row) {
  return (row / parts.rays->height_px() - 0.5) * parts.options.readout_ms * 1e-3;
}

void prepare_sensor(SceneCamera::Parts& parts) {
  parts.lens = lens_weights(parts.options.lens_sigma_px);
  const auto width = static_cast<std::size_t>(parts.rays->width_px());
  for (int y = 0; y < parts.rays->height_px(); ++y) {
    const float* cosine = parts.rays->cosines(y);
    for (std::size_t x = 0; x < width; ++x) {
      const double fallen =
          std::pow(std::max(0.0, static_cast<double>(cosine[x])), parts.options.vignetting_power);
      parts.vignetting.push_back(cosine[x] < 0 ? 0.0F : static_cast<float>(fallen));
    }
  }
  parts.tone.clear();
  if (parts.options.gamma == 1) return;
  constexpr int kSteps = (kLevels - 1) * kToneSteps;
  for (int i = 0; i <= kSteps; ++i) {
    const double toned = 255 * std::pow(static_cast<double>(i) / kSteps, 1 / parts.options.gamma);
    parts.tone.push_back(static_cast<std::uint8_t>(std::lround(toned)));
  }
}

void read_out_band(SceneExposure& exposure, int band) {
  const SceneCamera::Parts& parts = *exposure.parts;
  const auto width = static_cast<std::size_t>(parts.rays->width_px());
  Rows rows{.spread = std::vector<float>(width + parts.lens.size() - 1),
            .level = std::vector<float>(width),
            .noise = std::vector<float>(width)};
  const int end = std::min((band + 1) * kTilePx, parts.rays->height_px());
  for (int y = band * kTilePx; y < end; ++y) {
    spread_down(parts, exposure, y, rows.spread);
    spread_along(parts.lens, rows.spread, rows.level);
    const double time_s = to_seconds(exposure.stamp.time_since_epoch()) + row_time_s(parts, y + 0.5);
    const auto white = static_cast<float>(parts.options.white_level_dn * lamp_light(parts.options, time_s));
    const float* vignetting = parts.vignetting.data() + static_cast<std::size_t>(y) * width;
    for (std::size_t x = 0; x < width; ++x) rows.level[x] *= white * vignetting[x];
    add_noise(parts, exposure, y, rows);
    write_row(parts, rows.level, exposure.image.row(y));
  }
}

}  // namespace waymark::render
