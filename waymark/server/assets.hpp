#pragma once

#include <span>
#include <string_view>

namespace waymark {

/// A file of the page, packed with gzip.
struct Asset {
  std::string_view name;  ///< "index.html"
  std::span<const unsigned char> gzip;
};

/// The page as it was embedded when the program was built; empty where it was built without.
[[nodiscard]] std::span<const Asset> viewer_assets();

}  // namespace waymark
