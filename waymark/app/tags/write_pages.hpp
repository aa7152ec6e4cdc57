#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/base/error.hpp"
#include "waymark/plot/render.hpp"

namespace waymark {

/// What was written, and what ended it before its time.
struct WrittenPages {
  std::vector<std::string> files;
  Status status{};
};

/// The file of one page of many: "tags-07.png" is page 7 of 24 of "tags.png". The only page keeps the name.
[[nodiscard]] std::string page_path(const std::string& path, std::size_t page, std::size_t pages);

/// Where pages go.
struct PageFiles {
  plot::FileFormat format = plot::FileFormat::Pdf;
  std::string path{};
  double dpi = 300;  ///< of PNG
  bool replace =
      false;  ///< files that are there; else they are an error (Unwritable), and nothing is written
  std::string target{};  ///< words of a file (.yaml) beside the first page; empty: none
};

/// Writes pages to one PDF, or to an SVG or PNG each. Stops at the first that fails, or once it is cancelled.
[[nodiscard]] WrittenPages write_pages(const std::vector<plot::Drawing>& pages, const PageFiles& to,
                                       const JobControl& control);

}  // namespace waymark
