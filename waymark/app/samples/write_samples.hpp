#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/fields.hpp"

/// `waymark samples`: simulated data for learning, each piece with its ground truth.
namespace waymark {

struct SamplesJob {
  std::string folder{};    ///< folder to create; must be missing or empty
  std::uint64_t seed = 1;  ///< seed for all random noise

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.folder,
          JobField("folder FOLDER", "Folder to create; must be missing or empty").input().required());
    visit(self.seed, JobField("seed INTEGER", "Seed of all noise: the same seed gives the same samples"));
  }
};

struct SamplesReport {
  std::string folder{};
  std::uint64_t seed = 0;
  std::vector<std::string>
      files{};  ///< written files and folders, relative to the folder, in the order of README.txt
};

/// Writes a taught lap (lap.mcap), its map (map/), images of tags (images/) and of a calibration board
/// (calibration/), all with ground truth, and README.txt. Also writes a lap of the same robot with wheels,
/// motors, gyro and camera that differ from its robot file (other.mcap). Writes either everything or nothing.
/// The same seed produces the same files, except for the run times in map/summary.json.
[[nodiscard]] Result<SamplesReport> write_samples(const SamplesJob& job, const JobControl& control);
/// One line per item, followed by the path of README.txt.
[[nodiscard]] std::string to_text(const SamplesReport& report);
[[nodiscard]] ReportFields fields(const SamplesReport& report);

}  // namespace waymark
