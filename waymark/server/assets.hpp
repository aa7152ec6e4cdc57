#pragma once

#include <span>
#include <string_view>

namespace waymark {

/// A file that belongs to the page, compressed with gzip.
struct Asset {
  std::string_view name;  ///< such as "index.html"
  std::span<const unsigned char> gzip;
};

/// The files of the page, embedded at build time; empty if the program was built without it.
[[nodiscard]] std::span<const Asset> viewer_assets();

}  // namespace waymark
