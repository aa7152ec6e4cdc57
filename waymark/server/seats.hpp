#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>

namespace waymark {

/// Decides which connections a server keeps, including WebSockets. A new connection is rejected only if all
/// seats are taken by connections with the token. To make room, the oldest connection whose first request is
/// incomplete is dropped or, if there is none, the oldest one without the token. Uses no sockets, so that it
/// can be tested.
class Seats {
 public:
  using Id = std::uint64_t;
  static constexpr std::size_t kMaxSeats = 64;
  /// Number of seats that connections without the token cannot occupy for long.
  static constexpr std::size_t kReserved = 16;

  enum class Guest : std::uint8_t {
    Waiting,  ///< the first request is incomplete
    Looks,    ///< connected without the token
    Owner,    ///< connected with the token
  };

  explicit Seats(std::size_t most = kMaxSeats) : most_(most) {}

  /// An admitted connection; `nullopt` if all seats are taken by owners. `dropped` is the connection to close
  /// in order to make room for it.
  struct Admission {
    Id id = 0;
    std::optional<Id> dropped{};
  };
  [[nodiscard]] std::optional<Admission> admit();
  /// Updates a connection after its first request. Returns a connection to close if too many lack the token;
  /// this may be the same connection.
  [[nodiscard]] std::optional<Id> request_received(Id id, bool token);
  void leave(Id id) { guests_.erase(id); }

  [[nodiscard]] std::size_t taken() const { return guests_.size(); }
  [[nodiscard]] std::size_t most() const { return most_; }

 private:
  [[nodiscard]] std::optional<Id> oldest(Guest guest) const;
  [[nodiscard]] std::size_t count(Guest guest) const;

  std::size_t most_;
  std::map<Id, Guest> guests_{};  // ordered from oldest to newest
  Id next_ = 1;
};

/// Number of connections possible with the descriptors that this process may open, `kept` of which are
/// reserved for everything else (in particular for recording). A connection takes two, one for its socket and
/// one for the file it reads. At least 4, at most Seats::kMaxSeats.
[[nodiscard]] std::size_t seats_for(std::uint64_t descriptors, std::uint64_t kept);

}  // namespace waymark
