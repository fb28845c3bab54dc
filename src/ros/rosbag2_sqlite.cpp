#include <sqlite3.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "common/text.h"
#include "rosbag2_storage.h"

namespace mono_pose_tracker {
namespace {

using Database = std::shared_ptr<sqlite3>;

[[noreturn]] void refuse_database(const std::string& path, const std::string& problem) {
  throw std::runtime_error(path + ": cannot be read as a rosbag2 database (" + one_line(problem) +
                           "): expected a .db3 file of ROS 2");
}

/// A query and the row that it stands at.
class Statement {
 public:
  Statement(const std::string& path, Database database, const char* query)
      : path_(path), database_(std::move(database)) {
    if (sqlite3_prepare_v2(database_.get(), query, -1, &statement_, nullptr) != SQLITE_OK) {
      refuse_database(path_, sqlite3_errmsg(database_.get()));
    }
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  void bind(int index, const std::string& text) {
    sqlite3_bind_text(statement_, index, text.c_str(), -1, SQLITE_TRANSIENT);
  }
  void rewind() { sqlite3_reset(statement_); }
  /// Again from the start, with another number for its parameter.
  void begin(std::int64_t number) {
    rewind();
    sqlite3_bind_int64(statement_, 1, number);
  }
  bool step() {
    const int result = sqlite3_step(statement_);
    if (result != SQLITE_ROW && result != SQLITE_DONE) {
      refuse_database(path_, sqlite3_errmsg(database_.get()));
    }
    return result == SQLITE_ROW;
  }
  std::int64_t number(int column) const { return sqlite3_column_int64(statement_, column); }
  std::string bytes(int column) const {
    const void* const data = sqlite3_column_blob(statement_, column);
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_, column));
    return data ? std::string(static_cast<const char*>(data), size) : std::string();
  }

 private:
  std::string path_;
  Database database_;
  sqlite3_stmt* statement_ = nullptr;
};

/// Nothing is written: neither the file nor a journal beside it.
std::string read_only_address(const std::string& path) {
  std::string address = "file:";
  for (unsigned char c : std::filesystem::absolute(path).string()) {
    static const char kHex[] = "0123456789ABCDEF";
    if (c == '%' || c == '?' || c == '#') {
      address += {'%', kHex[c >> 4], kHex[c & 15]};
    } else {
      address += static_cast<char>(c);
    }
  }
  return address + "?mode=ro&immutable=1";
}

/// Throws if there is a write-ahead log, with messages that a killed recorder had not stored in the database.
void require_closed(const std::string& path) {
  const std::string log = path + "-wal";
  std::error_code error;
  if (std::filesystem::file_size(log, error) == 0 || error) return;
  throw std::runtime_error(path + ": was not closed, " + log +
                           " holds messages of it: expected a closed recording; `sqlite3 FILE 'pragma "
                           "wal_checkpoint(truncate)'` closes it");
}

Database open_database(const std::string& path, const StorageOptions& options) {
  require_closed(path);
  sqlite3* made = nullptr;
  const int result = sqlite3_open_v2(read_only_address(path).c_str(), &made,
                                     SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr);
  Database database(made, sqlite3_close_v2);
  if (result != SQLITE_OK) refuse_database(path, made ? sqlite3_errmsg(made) : "no memory");
  // The file is untrusted: its triggers and views are not executed.
  sqlite3_db_config(made, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(made, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_limit(made, SQLITE_LIMIT_LENGTH,
                static_cast<int>(std::min<std::uint64_t>(options.max_bytes, 0x7fffffff)));
  return database;
}

class SqliteCursor : public MessageCursor {
 public:
  SqliteCursor(const std::string& path, const Database& database, const std::string& topic)
      : order_(path, database,
               "select rowid from messages where topic_id in (select id from topics where name = ?) "
               "order by timestamp, rowid"),
        row_(path, database, "select timestamp, data from messages where rowid = ?") {
    order_.bind(1, topic);
    Statement count(path, database,
                    "select count(*) from messages where topic_id in (select id from topics where name = ?)");
    count.bind(1, topic);
    if (count.step()) size_ = static_cast<int>(count.number(0));
  }

  bool next(StoredMessage* message) override {
    if (!skip()) return false;
    row_.begin(order_.number(0));
    message->time_ns = 0;
    message->data.clear();
    if (!row_.step()) return true;
    message->time_ns = row_.number(0);
    message->data = row_.bytes(1);
    return true;
  }

  bool skip() override {
    if (has_ended_) return false;
    has_ended_ = true;  // where the step throws: nothing sound follows
    if (!order_.step()) return false;
    has_ended_ = false;
    return true;
  }

  void rewind() override {
    order_.rewind();
    has_ended_ = false;
  }

  int size() const override { return size_; }

 private:
  // Sorting the messages themselves would copy them all to a temporary file where the table has no index.
  Statement order_, row_;
  int size_ = -1;
  bool has_ended_ = false;
};

class SqliteStorage : public MessageStorage {
 public:
  SqliteStorage(const std::string& path, const StorageOptions& options)
      : path_(path), database_(open_database(path, options)) {
    Statement tables(path, database_,
                     "select count(*) from sqlite_master where type = 'table' and name in ('topics', "
                     "'messages')");
    if (!tables.step() || tables.number(0) != 2) {
      refuse_database(path, "it has no tables `topics` and `messages`");
    }
  }

  std::vector<StoredTopic> topics() const override {
    Statement rows(path_, database_, "select name, type, serialization_format from topics order by id");
    std::vector<StoredTopic> topics;
    while (rows.step()) topics.push_back({rows.bytes(0), rows.bytes(1), rows.bytes(2)});
    return topics;
  }

  std::unique_ptr<MessageCursor> open(const std::string& topic) const override {
    return std::make_unique<SqliteCursor>(path_, database_, topic);
  }

 private:
  const std::string path_;
  const Database database_;
};

}  // namespace

std::unique_ptr<MessageStorage> open_sqlite_storage(const std::string& path, const StorageOptions& options) {
  return std::make_unique<SqliteStorage>(path, options);
}

}  // namespace mono_pose_tracker
