#pragma once

#include <string>

#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/recording/mcap/recover.hpp"

/// `waymark recover`: copies the intact part of a damaged recording to a new file.
namespace waymark {

struct RecoverJob {
  std::string file;
  std::string output{};  ///< if empty, lap.recovered.mcap next to lap.mcap

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.file, JobField("file FILE", "Recording (.mcap) that is truncated, damaged or unfinished")
                         .input()
                         .required());
    visit(self.output, JobField("output FILE", "New file. Default: lap.recovered.mcap next to lap.mcap"));
  }
};

struct RecoverReport {
  std::string file{};
  std::string output{};
  mcap::Recovery recovery{};
};

[[nodiscard]] Result<RecoverReport> recover_log(const RecoverJob& job);
[[nodiscard]] std::string to_text(const RecoverReport& report);
[[nodiscard]] ReportFields fields(const RecoverReport& report);

}  // namespace waymark
