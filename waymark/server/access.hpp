#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"

/// Rights to watch and to command. A page of another site must not get access, even through a browser on this
/// machine (OWASP, "WebSocket Security Cheat Sheet", sections on Origin and authentication).
namespace waymark {

/// Access settings of a server.
struct AccessPolicy {
  std::uint16_t port = 0;
  bool remote = false;                ///< reachable from other machines: every request needs the token
  std::string token = {};             ///< empty: no viewer may command
  std::string address = "127.0.0.1";  ///< address to listen at, as in a URL: "127.0.0.2", "[::1]"
};

/// Fields of a request that identify its sender. Fields that were not sent are empty.
struct AccessClaim {
  std::string_view host;    ///< "localhost:8642"
  std::string_view origin;  ///< "http://localhost:8642"
  std::string_view target;  ///< "/live?token=…"
  std::string_view cookie;
};

struct AccessRights {
  /// Set if the request names another server (DNS rebinding), comes from another page, or lacks a required
  /// token.
  enum class Refusal : std::uint8_t { None, WrongHost, ForeignPage, NoToken };
  Refusal refusal = Refusal::None;
  bool token = false;       ///< has the token, in the address or in the cookie
  bool own_origin = false;  ///< sent by a page of this server, or not by a page
  bool by_address = false;  ///< the token is in the address, which browsers never add by themselves
};

/// Whether the field Host names this server. A local server has its address or localhost as a name, with the
/// port (browsers omit port 80). Any other name that resolves to it may come from a foreign page. A remote
/// server may have any name; it is protected by the token.
[[nodiscard]] bool is_own_host(std::string_view host, const AccessPolicy& policy);

/// Rights of a request. A foreign page is accepted only with the token in the address.
[[nodiscard]] AccessRights rights_of(const AccessClaim& claim, const AccessPolicy& policy);

/// The value of `name` in "/path?name=value&…"; empty if missing.
[[nodiscard]] std::string_view query_value(std::string_view target, std::string_view name);

/// "waymark_8642=TOKEN; …": the field Set-Cookie for the page that was opened with the token.
[[nodiscard]] std::string token_cookie(const AccessPolicy& policy);

/// 128 random bits from the system as 32 hexadecimal digits.
[[nodiscard]] std::string make_token();

/// Checks a token given by the user: 16 to 128 letters, digits, - and _.
[[nodiscard]] Status check_token(std::string_view token);

}  // namespace waymark
