#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"

/// Who may look, and who may command. A page of another site must reach nothing, also when a browser on this
/// machine is asked to (OWASP, "WebSocket Security Cheat Sheet", sections on Origin and authentication).
namespace waymark {

/// What a server is guarded by.
struct AccessPolicy {
  std::uint16_t port = 0;
  bool remote = false;     ///< reachable from other machines: then nothing is given away without the token
  std::string token = {};  ///< empty: nobody may command
  std::string address = "127.0.0.1";  ///< where it listens, as in a URL: "127.0.0.2", "[::1]"
};

/// What of a request says who asks. Fields that were not sent are empty.
struct AccessClaim {
  std::string_view host;    ///< "localhost:8642"
  std::string_view origin;  ///< "http://localhost:8642"
  std::string_view target;  ///< "/live?token=…"
  std::string_view cookie;
};

struct AccessRights {
  /// Not there: the request names another server (DNS rebinding), comes from another page, or lacks the
  /// token where one is needed.
  enum class Refusal : std::uint8_t { None, WrongHost, ForeignPage, NoToken };
  Refusal refusal = Refusal::None;
  bool token = false;       ///< it has the token, by the address or by the cookie
  bool own_origin = false;  ///< a page of this server asks, or no page at all
  bool by_address = false;  ///< the token stood in the address: no browser adds that by itself
};

/// Whether the field Host means this server. On this machine alone: by number or as localhost, with the port
/// (browsers leave out the port 80); another name that happens to lead here is how a foreign page would reach
/// it. A remote server has names we do not know, and is guarded by the token.
[[nodiscard]] bool is_own_host(std::string_view host, const AccessPolicy& policy);

/// What the asker may have. A foreign page gets something only when it knows the token by the address.
[[nodiscard]] AccessRights rights_of(const AccessClaim& claim, const AccessPolicy& policy);

/// The value of `name` in "/path?name=value&…"; empty when it is not there.
[[nodiscard]] std::string_view query_value(std::string_view target, std::string_view name);

/// "waymark_8642=TOKEN; …": the field Set-Cookie of the page that was opened with the token.
[[nodiscard]] std::string token_cookie(const AccessPolicy& policy);

/// 128 random bits of the system as 32 hexadecimal digits.
[[nodiscard]] std::string make_token();

/// A token of the user's own: 16 to 128 letters, digits, - and _.
[[nodiscard]] Status check_token(std::string_view token);

}  // namespace waymark
