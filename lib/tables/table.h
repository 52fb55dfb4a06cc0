// A table in memory: what a table file says, checked, with the index that makes the host fast.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "engine/table.h"
#include "words/table_content.h"

namespace bushd::tables {

// An MCU addresses the codes of a table, both sides together, by 16 bits.
inline constexpr std::size_t kMaxCodes = 65535;
inline constexpr std::int64_t kMaxRevision = 2147483647;

using words::TableContent;
inline constexpr std::uint32_t kMaxTimeUnitNs = TableContent::kMaxTimeUnitNs;
inline constexpr std::size_t kMaxNameLength = TableContent::kMaxNameLength;
inline constexpr bushd::fields::Range<std::int32_t> kCode = TableContent::kCode;

// SHA-256, as 64 hexadecimal digits, of what moves a motor: time unit, both sides and cruise delay,
// whether written or implied. Name, description and revision do not count.
// Precondition: check() finds nothing.
std::string content_hash(const TableContent& content);
inline constexpr std::size_t kShortHashLength = 8;

// What is wrong with a content, if anything: the first thing in the order of the members above.
struct ContentFault {
  std::string key;                   // as in a file
  std::optional<std::size_t> index;  // of an element of `key`
  std::string message;
};
std::optional<ContentFault> check(const TableContent& content);

// Immutable, so it may be shared by motors and threads. Not copyable: view() points into it.
class Table {
 public:
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;

  // Valid as long as this object; passed bushd_table_check (make_any_law: or the other one), and
  // both sides are indexed. If symmetric(), both sides are the same arrays.
  const bushd_table& view() const { return view_; }
  const std::string& name() const { return name_; }
  const std::string& description() const { return description_; }
  // Counted by bushtab at each change, from 1; 0: the file tells none.
  std::uint32_t revision() const { return revision_; }
  // content_hash, and its first 32 bits as 8 hexadecimal digits: for states and logs.
  const std::string& content_hash() const { return content_hash_; }
  std::string short_hash() const { return content_hash_.substr(0, kShortHashLength); }
  const std::string& path() const { return path_; }  // empty: not from a file
  bool symmetric() const { return view_.decel.code == view_.accel.code; }
  // Same name, unit, codes and cruise delay; where it was read from and its description do not
  // count.
  bool same_content(const Table& other) const;

 private:
  friend Result<std::shared_ptr<const Table>> make(TableContent content, std::string path);
  friend Result<std::shared_ptr<const Table>> make_any_law(TableContent content);
  static std::shared_ptr<const Table> of(TableContent content, std::string path);

  struct Side {
    std::vector<std::uint16_t> code;
    std::vector<std::uint32_t> sum;
    std::vector<std::uint32_t> bucket;
    bushd_ramp index();
  };

  Table() = default;

  std::string name_;
  std::string description_;
  std::string path_;
  std::string content_hash_;
  std::uint32_t revision_ = 0;
  Side accel_;
  Side decel_;  // empty if symmetric
  bushd_table view_{};
};

using TablePtr = std::shared_ptr<const Table>;

// Checks and indexes. An error's key names the offending element as in a file (`accel[17]`).
Result<TablePtr> make(TableContent content, std::string path = {});

// What make() does; and codes that rise and fall in any order, each side in that of a file, which
// are no table: bushd_table_is_written, for one run that has all of them
// (bushd_run_start_as_written).
Result<TablePtr> make_any_law(TableContent content);

}  // namespace bushd::tables
