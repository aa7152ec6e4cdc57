#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "waymark/samples/robot_samples.hpp"

/// Recognises a recording by its observations, whatever its file is called.
namespace waymark {

/// A sample of the observations in a recording: the smallest hashes of all observations, in ascending order.
/// The samples of two recordings estimate the share of observations that they have in common (Cohen and
/// Kaplan, "Summarizing Data using Bottom-k Sketches", 2007).
struct RecordingSketch {
  std::string name{};  ///< file name of the recording
  std::vector<std::uint32_t> hashes{};
};

/// Hashes the number of each tag and its corners, rounded to a quarter of a pixel.
[[nodiscard]] RecordingSketch sketch_of(std::string name, const std::vector<TagFrame>& frames);

/// The estimated share of the smaller recording's observations that the other one also contains, from 0 to 1.
[[nodiscard]] double common_share(const RecordingSketch& a, const RecordingSketch& b);

using MapProvenance = std::vector<std::pair<std::string, std::string>>;

/// The sketches in the provenance of a map: keys `content`, `content_2`, …
[[nodiscard]] std::vector<RecordingSketch> sketches_of(const MapProvenance& provenance);

/// Adds the sketches to the provenance of a map, before its key `extends`. Empty sketches are omitted.
void add_sketches(const std::vector<RecordingSketch>& sketches, MapProvenance& provenance);

/// The warning that the map with this provenance already contains the recording; empty if it does not.
/// Recordings without a sketch, in maps by earlier programs, are recognised by their name alone.
[[nodiscard]] std::string repeated_recording(const MapProvenance& extended, const RecordingSketch& recording);

}  // namespace waymark
