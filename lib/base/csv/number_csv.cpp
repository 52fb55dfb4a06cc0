#include "base/csv/number_csv.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <unordered_set>
#include <utility>

#include "base/byte_order_mark.h"
#include "base/parse_number.h"
#include "base/printable.h"
#include "base/shortened.h"

namespace bushd::csv {
namespace {

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

struct Field {
  std::string_view text;
  int column;  // where it begins, 1-based
};

std::vector<Field> fields_of(std::string_view line) {
  std::vector<Field> fields;
  for (std::size_t at = 0;;) {
    const std::size_t comma = std::min(line.find(',', at), line.size());
    const std::string_view text = trimmed(line.substr(at, comma - at));
    const auto begins = text.empty() ? at : static_cast<std::size_t>(text.data() - line.data());
    fields.push_back({text, static_cast<int>(begins) + 1});
    if (comma == line.size()) return fields;
    at = comma + 1;
  }
}

class Reader {
 public:
  Reader(const std::string& file, std::size_t most_rows) : most_rows_(most_rows) {
    table_.file = file;
  }

  Result<void> take(std::string_view line, int number) {
    line_ = number;
    if (trimmed(line).empty() || trimmed(line).starts_with('#')) return {};
    const std::vector<Field> fields = fields_of(line);
    return table_.columns.empty() ? take_names(fields) : take_row(fields);
  }

  Result<NumberTable> table() {
    if (table_.columns.empty()) {
      return fail(error(0, "is empty; its first line names the columns: a,b"));
    }
    if (table_.rows() == 0) return fail(error(0, "has no row of numbers below the names"));
    return std::move(table_);
  }

 private:
  Result<void> take_names(const std::vector<Field>& fields) {
    for (const Field& field : fields) {
      const std::string name(field.text);
      if (name.empty()) return fail(error(field.column, "a column without a name"));
      if (!names_.insert(name).second) {
        return fail(error(field.column, fmt::format("the column \"{}\" is there twice",
                                                    printable(shortened(name)))));
      }
      table_.columns.push_back({.name = name, .numbers = {}});
    }
    return {};
  }

  Result<void> take_row(const std::vector<Field>& fields) {
    if (table_.rows() == most_rows_) {
      return fail(error(0, fmt::format("more than {} rows", most_rows_)));
    }
    if (fields.size() != table_.columns.size()) {
      return fail(error(0, fmt::format("{} numbers; allowed: {}, one for each name above",
                                       fields.size(), table_.columns.size())));
    }
    for (std::size_t i = 0; i < fields.size(); ++i) {
      const auto number = parse_signed<double>(fields[i].text);
      if (!number) {
        return fail(error(fields[i].column,
                          fmt::format("\"{}\", as {}; allowed: a decimal number such as -12.5",
                                      printable(shortened(fields[i].text)),
                                      printable(shortened(table_.columns[i].name)))));
      }
      table_.columns[i].numbers.push_back(*number);
    }
    table_.lines.push_back(line_);
    return {};
  }

  Error error(int column, std::string message) const {
    return {.message = std::move(message), .file = table_.file, .line = line_, .column = column};
  }

  NumberTable table_;
  std::size_t most_rows_;
  std::unordered_set<std::string> names_{};
  int line_ = 0;
};

}  // namespace

Result<NumberTable> parse_numbers(std::string_view text, const std::string& file,
                                  std::size_t most_rows) {
  text = without_byte_order_mark(text);
  Reader reader(file, most_rows);
  for (int line = 1; !text.empty(); ++line) {
    const std::size_t end = text.find('\n');
    if (auto taken = reader.take(text.substr(0, end), line); !taken) return fail(taken.error());
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  return reader.table();
}

}  // namespace bushd::csv
