#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/fields.hpp"

/// `waymark samples`: simulated data to learn with, each piece with its truth.
namespace waymark {

struct SamplesJob {
  std::string folder{};    ///< that is made; fails where one stands that is not empty
  std::uint64_t seed = 1;  ///< of everything in it

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.folder,
          JobField("folder FOLDER", "Folder to make; one that is not empty is refused").input().required());
    visit(self.seed, JobField("seed INTEGER", "Seed of all noise: the same seed gives the same samples"));
  }
};

struct SamplesReport {
  std::string folder{};
  std::uint64_t seed = 0;
  std::vector<std::string> files{};  ///< and folders, relative to the folder, in the order of README.txt
};

/// Writes a taught lap (lap.mcap) and its map (map/), a lap of the same robot whose wheels, motors, gyro and
/// camera differ from what its file says (other.mcap), photographs of tags (pictures/) and of a calibration
/// board (calibration/), with the truth beside them, and README.txt. All of it, or nothing. The same seed
/// gives the same files, but for the run times in map/summary.json.
[[nodiscard]] Result<SamplesReport> write_samples(const SamplesJob& job, const JobControl& control);
/// A line a piece: what it is, and the verb that reads it.
[[nodiscard]] std::string to_text(const SamplesReport& report);
[[nodiscard]] ReportFields fields(const SamplesReport& report);

}  // namespace waymark
