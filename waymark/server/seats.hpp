#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>

namespace waymark {

/// Decides which connections a server keeps, including WebSockets. A new connection is rejected only if all
/// seats belong to connections with the token. To make room, the oldest connection with an unfinished first
/// request is dropped, then the oldest without the token. Contains no sockets, for tests.
class Seats {
 public:
  using Id = std::uint64_t;
  static constexpr std::size_t kMaxSeats = 64;
  /// Seats that connections without the token cannot keep occupied.
  static constexpr std::size_t kReserved = 16;

  enum class Guest : std::uint8_t {
    Waiting,  ///< its first request is incomplete
    Looks,    ///< without the token
    Owner,    ///< with the token
  };

  explicit Seats(std::size_t most = kMaxSeats) : most_(most) {}

  /// An admitted connection; nothing if all seats belong to owners. `dropped`: the connection to close in its
  /// favour.
  struct Admission {
    Id id = 0;
    std::optional<Id> dropped{};
  };
  [[nodiscard]] std::optional<Admission> admit();
  /// Updates a connection after its first request. Returns a connection to close if too many lack the token;
  /// it may be this one.
  [[nodiscard]] std::optional<Id> request_received(Id id, bool token);
  void leave(Id id) { guests_.erase(id); }

  [[nodiscard]] std::size_t taken() const { return guests_.size(); }
  [[nodiscard]] std::size_t most() const { return most_; }

 private:
  [[nodiscard]] std::optional<Id> oldest(Guest guest) const;
  [[nodiscard]] std::size_t count(Guest guest) const;

  std::size_t most_;
  std::map<Id, Guest> guests_{};  // oldest first
  Id next_ = 1;
};

/// Number of connections that fit into the descriptors this process may open, with `kept` of them reserved
/// for everything else (recording above all). A connection takes two: its socket, and the file it reads. At
/// least 4, at most Seats::kMaxSeats.
[[nodiscard]] std::size_t seats_for(std::uint64_t descriptors, std::uint64_t kept);

}  // namespace waymark
