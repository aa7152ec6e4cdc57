#include "waymark/tags/tag_bands.hpp"

#include <algorithm>
#include <cstddef>

namespace waymark::refinement {
namespace {

constexpr int kFewestPixels = 40;
constexpr int kFewestPixelsOfEdge = 8;

BandLimits band_limits(const EdgeFrame& edge, double blur_px, bool first_pass) {
  constexpr double kSearchPx = 0.7;
  const double reach = std::max(2.5, 3.5 * blur_px) + (first_pass ? kSearchPx : 0.0);
  BandLimits limits;
  limits.cells_matter = edge.cell_px < reach + 3.0 * blur_px;
  // Beyond the middle of the border the model of one row of bits ends; margins are often cut to one cell.
  limits.inside_px = limits.cells_matter ? std::min(reach, 0.8 * edge.cell_px) : reach;
  limits.outside_px = limits.cells_matter ? std::min(reach, edge.cell_px) : reach;
  limits.max_slices = first_pass ? kMaxSlices / 4 : kMaxSlices;  // the first pass only has to find the place
  limits.corner_margin_px = std::min((limits.cells_matter ? 2.0 : 2.5) * blur_px, 0.25 * edge.length_px);
  return limits;
}

/// One value for every slice of every edge.
using SliceValues = std::array<float, 4 * kMaxSlices>;

double median(SliceValues& values, std::size_t first, std::size_t last) {
  if (first == last) return 0.0;
  const auto at = [&](std::size_t i) { return values.begin() + static_cast<std::ptrdiff_t>(i); };
  const auto middle = at(first + (last - first) / 2);
  std::nth_element(at(first), middle, at(last));
  return static_cast<double>(*middle);
}

using SliceMeans = SliceCosts;  ///< here per pixel

Lanes slice_pixels(const Band& band, std::size_t b) {
  Lanes count = Lanes::Zero();
  for (std::size_t j = 0; j < static_cast<std::size_t>(band.depth); ++j) count += band.weight[b][j];
  return count;
}

/// The number of pixels dropped.
int drop_slices_above(float limit, const SliceMeans& means, Band& band) {
  int dropped = 0;
  for (std::size_t b = 0; b < static_cast<std::size_t>(band.blocks); ++b) {
    if ((means[b] <= limit).all()) continue;
    const Lanes keep = (means[b] <= limit).select(Lanes::Ones(), 0.0F);
    dropped += static_cast<int>((slice_pixels(band, b) * (1.0F - keep)).sum() + 0.5F);
    for (std::size_t j = 0; j < static_cast<std::size_t>(band.depth); ++j) band.weight[b][j] *= keep;
  }
  band.pixels -= dropped;
  return dropped;
}

}  // namespace

double level_at_rim(const TagBands& tag, bool outermost) {
  SliceValues values;
  std::size_t count = 0;
  for (const Band& band : tag.bands) {
    for (int s = 0; s < band.slices; ++s) {
      const auto b = static_cast<std::size_t>(s / kLanes);
      for (int step = 0; step < band.depth; ++step) {
        const auto j = static_cast<std::size_t>(outermost ? band.depth - 1 - step : step);
        if (band.weight[b][j][s % kLanes] == 0.0F) continue;
        values[count++] = band.value[b][j][s % kLanes];
        break;
      }
    }
  }
  return median(values, 0, count);
}

bool read_bands(const ImageView& image, const std::array<Surroundings, 4>& near, double blur_px,
                bool first_pass, TagBands& tag) {
  tag.pixels = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const BandLimits limits = band_limits(tag.edges[k], blur_px, first_pass);
    read_band(image, tag.edges[k], near[k], limits, blur_px, tag.bands[k]);
    if (tag.bands[k].pixels < kFewestPixelsOfEdge) return false;
    tag.pixels += tag.bands[k].pixels;
  }
  return tag.pixels >= kFewestPixels;
}

double linearize_all(const std::array<EdgeVector, 4>& edges, const Eigen::Vector2d& light_per_px,
                     TagBands& tag) {
  double cost = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const double light = 0.5 * light_per_px.dot(tag.edges[k].to - tag.edges[k].from);
    tag.normals[k] = linearize(tag.bands[k], edges[k], light, tag.costs[k]);
    cost += tag.normals[k].cost;
  }
  return cost;
}

DroppedSlices drop_outliers(TagBands& tag) {
  std::array<SliceMeans, 4> means;
  SliceValues values;
  std::size_t count = 0;
  std::array<double, 4> medians{};
  for (std::size_t k = 0; k < 4; ++k) {
    const Band& band = tag.bands[k];
    const std::size_t first = count;
    for (std::size_t b = 0; b < static_cast<std::size_t>(band.blocks); ++b) {
      const Lanes pixels = slice_pixels(band, b);
      means[k][b] = tag.costs[k][b] / pixels.max(1.0F);
      for (int lane = 0; lane < kLanes; ++lane) {
        if (pixels[lane] > 0.0F) values[count++] = means[k][b][lane];
      }
    }
    medians[k] = median(values, first, count);
  }
  const double usual = median(values, 0, count);
  constexpr double kOutOfProportion = 16.0;  // four times the usual residual
  constexpr double kOfOwnEdge = 4.0;
  DroppedSlices dropped;
  for (std::size_t k = 0; k < 4; ++k) {
    // What covers an edge also pulls its fit off the slices that are good: spare those for now.
    const double limit = std::max(kOutOfProportion * (usual + 0.25), kOfOwnEdge * medians[k]);
    dropped.pixels += drop_slices_above(static_cast<float>(limit), means[k], tag.bands[k]);
    dropped.enough_left = dropped.enough_left && tag.bands[k].pixels >= kFewestPixelsOfEdge;
  }
  tag.pixels -= dropped.pixels;
  dropped.enough_left = dropped.enough_left && tag.pixels >= kFewestPixels;
  return dropped;
}

}  // namespace waymark::refinement
