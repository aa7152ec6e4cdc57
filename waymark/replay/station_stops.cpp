#include "waymark/replay/station_stops.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace waymark {
namespace {

constexpr double kSamePlace_m = 0.1;
constexpr double kBeyond_m = 1e-6;

}  // namespace

/// The nearest station at or beyond a way.
void StationStops::aim(double from_m) {
  next_way_m_.reset();
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    double way_m = stations_[i].arc_length_m;
    if (closed_) way_m += length_m_ * std::ceil((from_m - way_m) / length_m_);
    if (way_m < from_m || (next_way_m_ && way_m >= *next_way_m_)) continue;
    next_ = i;
    next_way_m_ = way_m;
  }
}

void StationStops::begin(double way_m) {
  if (standing_ && std::abs(way_m - *next_way_m_) < kSamePlace_m) return;
  standing_ = false;
  const double from_m = way_m - kSamePlace_m;
  aim(served_way_m_ ? std::max(from_m, *served_way_m_ + kBeyond_m) : from_m);
  // What lies where a closed route begins is where its laps end, and served there.
  const bool at_seam = closed_ && !served_way_m_ && next_way_m_ && *next_way_m_ < kBeyond_m;
  if (at_seam) aim(kBeyond_m);
}

void StationStops::arrive(double way_m, double within_m) {
  if (standing_ || left_m(way_m) > within_m) return;
  standing_ = true;
  left_s_ = stations_[next_].pause_s;
}

void StationStops::stand(double dt_s) {
  if (!standing_) return;
  left_s_ -= dt_s;
  if (left_s_ > 0) return;
  standing_ = false;
  served_way_m_ = next_way_m_;
  aim(*served_way_m_ + kBeyond_m);
}

double StationStops::left_m(double way_m) const {
  return next_way_m_ ? *next_way_m_ - way_m : std::numeric_limits<double>::infinity();
}

}  // namespace waymark
