// What `bushctl watch` shows of a status in a terminal of this size, and what keys change of that:
// the order, the page, a filter. Motors that move come first, then those with which something is
// wrong, the worst before.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "client/status.h"

namespace bushctl {

class WatchTable {
 public:
  // Names of motors, or patterns; none: all.
  explicit WatchTable(std::vector<std::string> names) : names_(std::move(names)) {}

  // Whether the user goes on.
  bool take_keys(std::string_view bytes);

  // At most `rows` lines of at most `columns` characters, as far as that is possible: a summary,
  // MCUs that do not work, a page of motors, and what keys do. A page that there is not any more
  // becomes the last one. `notice`: in place of the keys.
  std::vector<std::string> lines(const bushd::client::Status& status, std::size_t columns,
                                 std::size_t rows, const std::string& notice = {});

 private:
  struct Row;

  void take_key(std::string_view key);
  void type(std::string_view key);
  std::vector<Row> rows_of(const bushd::client::Status& status) const;
  bool is_shown(const Row& row) const;
  std::string summary(const bushd::client::Status& status, std::size_t shown) const;
  std::string last_line(std::size_t pages) const;

  std::vector<std::string> names_;
  std::string filter_;  // typed
  bool typing_ = false;
  bool as_configured_ = false;
  bool goes_on_ = true;
  std::size_t page_ = 0;
};

}  // namespace bushctl
