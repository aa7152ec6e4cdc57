#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "waymark/server/access.hpp"

namespace waymark {

/// A file that the server offers. Other files cannot be requested.
struct OfferedFile {
  enum class Kind : std::uint8_t { Recording, Text };
  std::string name;  ///< as shown on the page
  std::filesystem::path path;
  Kind kind = Kind::Recording;
  /// The offered folder; links must not lead outside it. Empty if the file itself was given.
  std::filesystem::path within{};
};

/// Whether the file is in the folder after all links are resolved. False if a link target does not exist.
[[nodiscard]] bool lies_within(const std::filesystem::path& file, const std::filesystem::path& folder);

struct OfferedThings {
  std::vector<OfferedFile> files{};
  bool live = false;  ///< a running robot
};

/// Relevant fields of a request. Header fields that were not sent are empty.
struct HttpRequest {
  std::string_view method;
  std::string_view target;  ///< "/files/0/lap.mcap"
  std::string_view host;    ///< "localhost:8642"
  std::string_view origin;
  std::string_view cookie;
  std::string_view range;  ///< "bytes=0-99"
  bool accepts_gzip = false;
};

/// A part of a file.
struct FilePart {
  std::filesystem::path path;
  std::uint64_t first = 0;   ///< [byte]
  std::uint64_t length = 0;  ///< [byte]
};

struct HttpReply {
  int status = 200;
  std::vector<std::pair<std::string, std::string>> headers;
  std::variant<std::string, std::string_view, FilePart> body;  ///< a view has static lifetime

  [[nodiscard]] std::uint64_t length() const;
};

/// Reply to a request: the page, `session.json` (the offered files), `files/N/NAME` by ranges, or
/// `tags/FAMILY/ID` (the printed cells of a tag). Requests without the required rights get an error
/// (access.hpp). A page opened with the token in the address gets the token as a cookie and is redirected to
/// the address without it. Never fails; reads only the size of a file, not its contents.
[[nodiscard]] HttpReply reply_to(const HttpRequest& request, const OfferedThings& offered,
                                 const AccessPolicy& policy);

/// Reply to a refused request: status and text.
[[nodiscard]] HttpReply refusal_of(AccessRights::Refusal refusal, const AccessPolicy& policy);

/// First byte and length of "bytes=0-99", "bytes=100-" or "bytes=-50" within `size` bytes.
struct ByteRange {
  /// Whole: also for an unsupported header.
  enum class Kind : std::uint8_t { Whole, Part, Unsatisfiable };
  Kind kind = Kind::Whole;
  std::uint64_t first = 0;
  std::uint64_t length = 0;
};
[[nodiscard]] ByteRange parse_range(std::string_view header, std::uint64_t size);

}  // namespace waymark
