#include "waymark/recording/ros2/sqlite_database.hpp"

#include <algorithm>
#include <array>
#include <climits>
#include <fstream>

#include <sys/mman.h>

#include <fmt/format.h>
#include <sqlite3.h>

namespace waymark {
namespace {

/// How a file is opened. A WAL is the journal of a recorder in write-ahead mode (sqlite.org, "Write-Ahead
/// Logging"). SQLite creates an index for it next to the file. If there was no index before, the recorder has
/// ended, and the new index is removed again.
enum class Access : std::uint8_t { Shared, SharedAndTidy, Immutable };

/// URI with which SQLite opens a path without writing.
std::string read_only_uri(const std::filesystem::path& path, Access access) {
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(path).string()) {
    if (c == '?' || c == '#' || c == '%') {
      uri += fmt::format("%{:02X}", static_cast<unsigned char>(c));
    } else {
      uri += c;
    }
  }
  return uri + (access == Access::Immutable ? "?mode=ro&immutable=1" : "?mode=ro");
}

std::shared_ptr<sqlite3> hardened(std::shared_ptr<sqlite3> database) {
  const char* harden =
      "PRAGMA trusted_schema=OFF; PRAGMA cell_size_check=ON; PRAGMA mmap_size=0;"
      "SELECT count(*) FROM sqlite_master";
  sqlite3_db_config(database.get(), SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  const bool listed = sqlite3_exec(database.get(), harden, nullptr, nullptr, nullptr) == SQLITE_OK;
  return listed ? database : nullptr;
}

std::string wal_index_of(const std::filesystem::path& path) { return path.string() + "-shm"; }

std::shared_ptr<sqlite3> open_path(const std::filesystem::path& path, Access access) {
  sqlite3* raw = nullptr;
  const int code = sqlite3_open_v2(read_only_uri(path, access).c_str(), &raw,
                                   SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
  const std::string left_behind = access == Access::SharedAndTidy ? wal_index_of(path) : std::string();
  std::shared_ptr<sqlite3> database(raw, [left_behind](sqlite3* open) {
    sqlite3_close(open);
    std::error_code ignored;
    if (!left_behind.empty()) std::filesystem::remove(left_behind, ignored);
  });
  if (code != SQLITE_OK) return nullptr;
  sqlite3_db_config(raw, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  return hardened(std::move(database));
}

/// Whether the header marks write-ahead mode.
bool writes_ahead(const std::filesystem::path& path) {
  constexpr std::size_t kReadVersion = 19;
  std::array<char, kReadVersion + 1> head{};
  std::ifstream(path, std::ios::binary).read(head.data(), head.size());
  return head[kReadVersion] == 2;
}

Access access_to(const std::filesystem::path& path) {
  if (!writes_ahead(path)) return Access::Shared;
  std::error_code none;
  const auto waiting = std::filesystem::file_size(path.string() + "-wal", none);
  if (none || waiting == 0) return Access::Immutable;
  return std::filesystem::exists(wal_index_of(path), none) ? Access::Shared : Access::SharedAndTidy;
}

/// A file's bytes, mapped copy-on-write.
std::shared_ptr<unsigned char> mapped(const TemporaryFile& file) {
  const auto size = static_cast<std::size_t>(file.size());
  void* at = ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE, file.descriptor(), 0);
  if (at == MAP_FAILED) return nullptr;  // NOLINT(cppcoreguidelines-pro-type-cstyle-cast)
  return {static_cast<unsigned char*>(at), [size](unsigned char* bytes) { ::munmap(bytes, size); }};
}

std::shared_ptr<sqlite3> open_mapped(const TemporaryFile& file) {
  constexpr std::size_t kHeader = 100;
  std::shared_ptr<unsigned char> bytes = file.size() >= kHeader ? mapped(file) : nullptr;
  sqlite3* raw = nullptr;
  if (!bytes ||
      sqlite3_open_v2(":memory:", &raw, SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX, nullptr) != SQLITE_OK) {
    sqlite3_close(raw);
    return nullptr;
  }
  std::shared_ptr<sqlite3> database(raw, [bytes](sqlite3* open) { sqlite3_close(open); });
  // An unnamed file has no journal, so it is read in a mode without one (SQLite, "Database File Format",
  // 1.3.3).
  bytes.get()[18] = std::min<unsigned char>(bytes.get()[18], 1);
  bytes.get()[19] = std::min<unsigned char>(bytes.get()[19], 1);
  const auto size = static_cast<sqlite3_int64>(file.size());
  if (sqlite3_deserialize(raw, "main", bytes.get(), size, size, SQLITE_DESERIALIZE_READONLY) != SQLITE_OK)
    return nullptr;
  return hardened(std::move(database));
}

Status limit_or_damage(const std::shared_ptr<sqlite3>& database, const std::string& name,
                       std::uint64_t max_value_bytes) {
  if (!database)
    return fail(ErrorCode::Unreadable, "damaged SQLite file: its tables cannot be listed", {.source = name},
                "`sqlite3 FILE .recover` may save part of the data.");
  sqlite3_limit(database.get(), SQLITE_LIMIT_LENGTH,
                static_cast<int>(std::min<std::uint64_t>(max_value_bytes, INT_MAX)));
  return {};
}

}  // namespace

Result<SqliteDatabase> SqliteDatabase::open(const std::filesystem::path& path, std::string name,
                                            std::uint64_t max_value_bytes) {
  const Access access = access_to(path);
  std::shared_ptr<sqlite3> database = open_path(path, access);
  // The journal of a crashed recorder cannot be used in a read-only folder.
  if (!database) database = open_path(path, Access::Immutable);
  if (Status status = limit_or_damage(database, name, max_value_bytes); !status)
    return tl::unexpected(status.error());
  return SqliteDatabase(std::move(database), std::move(name));
}

Result<SqliteDatabase> SqliteDatabase::open(std::shared_ptr<const TemporaryFile> file, std::string name,
                                            std::uint64_t max_value_bytes) {
  std::shared_ptr<sqlite3> database = open_mapped(*file);
  if (Status status = limit_or_damage(database, name, max_value_bytes); !status)
    return tl::unexpected(status.error());
  return SqliteDatabase(std::move(database), std::move(name));
}

Error SqliteDatabase::error() const {
  return {ErrorCode::Unreadable,
          fmt::format("SQLite: {}", sqlite3_errmsg(database_.get())),
          {.source = name_},
          {}};
}

std::set<std::string> SqliteDatabase::columns(const std::string& table) const {
  std::set<std::string> names;
  Result<Query> real = query(fmt::format(
      "SELECT count(*) FROM sqlite_master WHERE type='table' AND name='{}' AND sql LIKE 'CREATE TABLE%'",
      table));
  if (!real || !real->next().value_or(false) || real->integer(0) != 1) return names;
  Result<Query> query = this->query(fmt::format("PRAGMA table_info({})", table));
  while (query && query->next().value_or(false)) names.insert(query->text(1));
  return names;
}

Result<SqliteDatabase::Query> SqliteDatabase::query(const std::string& sql) const {
  sqlite3_stmt* raw = nullptr;
  if (sqlite3_prepare_v2(database_.get(), sql.c_str(), -1, &raw, nullptr) != SQLITE_OK)
    return tl::unexpected(error());
  return Query(*this, raw);
}

SqliteDatabase::Query::Query(const SqliteDatabase& database, sqlite3_stmt* statement)
    : database_(&database), statement_(statement, sqlite3_finalize) {}

Result<bool> SqliteDatabase::Query::next() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  return tl::unexpected(database_->error());
}

std::int64_t SqliteDatabase::Query::integer(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

std::string SqliteDatabase::Query::text(int column) const {
  const unsigned char* text = sqlite3_column_text(statement_.get(), column);
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return text == nullptr ? std::string() : std::string(text, text + size);
}

ByteSpan SqliteDatabase::Query::bytes(int column) const {
  const void* data = sqlite3_column_blob(statement_.get(), column);
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return {static_cast<const std::uint8_t*>(data), static_cast<std::size_t>(data == nullptr ? 0 : size)};
}

SqliteDatabase::Query& SqliteDatabase::Query::bind(int parameter, std::int64_t value) {
  sqlite3_bind_int64(statement_.get(), parameter, value);
  return *this;
}

}  // namespace waymark
