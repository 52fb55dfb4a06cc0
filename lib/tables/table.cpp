#include "tables/table.h"

#include <fmt/core.h>
#include <glib.h>

#include <algorithm>
#include <utility>

namespace bushd::tables {
namespace {

bool is_control(char c) {
  return static_cast<unsigned char>(c) < 0x20 || c == 0x7F;
}

std::string code_is_zero() {
  return fmt::format("is 0; allowed: {}..{} time units", kCode.least, kCode.most);
}

std::optional<ContentFault> check_name(const std::string& name) {
  if (!name.empty() && name.size() <= kMaxNameLength &&
      std::none_of(name.begin(), name.end(), is_control)) {
    return std::nullopt;
  }
  return ContentFault{
      "name", std::nullopt,
      fmt::format("has {} bytes or a control character; allowed: 1..{} bytes of text", name.size(),
                  kMaxNameLength)};
}

std::optional<ContentFault> check_sizes(const TableContent& content) {
  const std::size_t accel = content.accel.size();
  const std::size_t decel = content.decel ? content.decel->size() : 0;
  if (accel == 0) return ContentFault{"accel", std::nullopt, "is empty; allowed: 1 code or more"};
  if (content.decel && decel == 0) {
    return ContentFault{
        "decel", std::nullopt,
        "is empty; allowed: 1 code or more, or leave it out: then it is accel reversed"};
  }
  if (accel + decel <= kMaxCodes) return std::nullopt;
  return ContentFault{
      accel > kMaxCodes ? "accel" : "decel", std::nullopt,
      fmt::format("makes {} codes in all; allowed: {}, because an MCU addresses the "
                  "codes of a table by 16 bits. Use a steeper ramp",
                  accel + decel, kMaxCodes)};
}

// The engine counts both sides from slow to fast; a file lists decel from fast to slow.
ContentFault place(bushd_status status, std::uint32_t engine_index, bool in_decel,
                   const std::vector<std::uint16_t>& accel,
                   const std::vector<std::uint16_t>& decel) {
  const std::string key = in_decel ? "decel" : "accel";
  const std::vector<std::uint16_t>& file_order = in_decel ? decel : accel;
  const std::size_t last = file_order.size() - 1;
  const std::size_t at = in_decel ? last - engine_index : engine_index;
  switch (status) {
    case BUSHD_E_TABLE_ZERO:
      return {key, at, code_is_zero()};
    case BUSHD_E_TABLE_UNSORTED: {
      // Two codes clash; the one that comes later in the file is the one to name.
      const std::size_t later = in_decel ? at + 1 : at;
      return {key, later,
              fmt::format("is {} after {}; allowed: codes that never {} ({} is listed from {})",
                          file_order[later], file_order[later - 1], in_decel ? "fall" : "rise", key,
                          in_decel ? "fast to slow" : "slow to fast")};
    }
    case BUSHD_E_TABLE_TOO_LONG:
      return {
          key, at,
          "the delays between rest and this code add up to more than 2147483647 time units, the "
          "longest ramp that can be run. Use a larger time_unit_ns or fewer codes"};
    default:
      return {key, at, bushd_status_text(status)};
  }
}

// With its codes, and room for those of the other side.
bushd_table view_of(const TableContent& content, std::vector<std::uint16_t>& slow_to_fast) {
  bushd_table view{};
  view.accel.code = content.accel.data();
  view.accel.count = static_cast<std::uint16_t>(content.accel.size());
  view.decel = view.accel;
  view.cruise = 1;
  view.time_unit_ns = 1;
  if (content.decel) {
    slow_to_fast.assign(content.decel->rbegin(), content.decel->rend());
    view.decel.code = slow_to_fast.data();
    view.decel.count = static_cast<std::uint16_t>(slow_to_fast.size());
  }
  return view;
}

std::optional<ContentFault> check_codes(const TableContent& content) {
  std::vector<std::uint16_t> slow_to_fast;
  const bushd_table view = view_of(content, slow_to_fast);
  std::uint32_t index = 0;
  bool in_decel = false;
  const bushd_status status = bushd_table_check(&view, &index, &in_decel);
  if (status == BUSHD_OK) return std::nullopt;
  return place(status, index, in_decel, content.accel, content.decel.value_or(content.accel));
}

std::optional<ContentFault> check_written(const TableContent& content) {
  std::vector<std::uint16_t> slow_to_fast;
  const bushd_table view = view_of(content, slow_to_fast);
  const bushd_status status = bushd_table_check_written(&view);
  if (status == BUSHD_OK) return std::nullopt;
  return ContentFault{"accel", std::nullopt,
                      fmt::format("or decel: {}; allowed: {}..{} time units, 2147483647 in all",
                                  bushd_status_text(status), kCode.least, kCode.most)};
}

// `codes`: what is wrong with them.
template <class Codes>
std::optional<ContentFault> check_all(const TableContent& content, Codes&& codes) {
  if (auto fault = check_name(content.name)) return fault;
  if (content.time_unit_ns < 1 || content.time_unit_ns > kMaxTimeUnitNs) {
    return ContentFault{
        "time_unit_ns", std::nullopt,
        fmt::format("is {}; allowed: 1..{} (1 s)", content.time_unit_ns, kMaxTimeUnitNs)};
  }
  if (auto fault = check_sizes(content)) return fault;
  if (auto fault = codes(content)) return fault;
  if (content.cruise == std::uint16_t{0}) {
    return ContentFault{"cruise", std::nullopt, code_is_zero()};
  }
  return std::nullopt;
}

Error error_of(const ContentFault& fault, const std::string& path) {
  const std::string index = fault.index ? fmt::format("[{}]", *fault.index) : "";
  return Error{.message = fault.message, .file = path, .key = fault.key + index};
}

}  // namespace

std::optional<ContentFault> check(const TableContent& content) {
  return check_all(content, check_codes);
}

std::string content_hash(const TableContent& content) {
  struct Free {
    void operator()(GChecksum* checksum) const { g_checksum_free(checksum); }
  };
  const std::unique_ptr<GChecksum, Free> checksum(g_checksum_new(G_CHECKSUM_SHA256));
  // Numbers as decimal text with a separator: the same on every machine, and not ambiguous.
  std::string text;
  const auto add = [&](std::uint32_t number) { text += fmt::format("{} ", number); };
  const auto flush = [&] {
    g_checksum_update(checksum.get(), reinterpret_cast<const guchar*>(text.data()),
                      static_cast<gssize>(text.size()));
    text.clear();
  };
  add(content.time_unit_ns);
  add(content.cruise.value_or(content.accel.back()));
  add(static_cast<std::uint32_t>(content.accel.size()));
  for (const std::uint16_t code : content.accel) add(code);
  flush();
  if (content.decel) {
    for (const std::uint16_t code : *content.decel) add(code);
  } else {
    for (auto code = content.accel.rbegin(); code != content.accel.rend(); ++code) add(*code);
  }
  flush();
  return g_checksum_get_string(checksum.get());
}

bool Table::same_content(const Table& other) const {
  return name_ == other.name_ && view_.time_unit_ns == other.view_.time_unit_ns &&
         view_.cruise == other.view_.cruise && accel_.code == other.accel_.code &&
         decel_.code == other.decel_.code;
}

bushd_ramp Table::Side::index() {
  bushd_ramp ramp{};
  ramp.code = code.data();
  ramp.count = static_cast<std::uint16_t>(code.size());
  sum.resize(bushd_ramp_sum_entries(&ramp));
  bucket.resize(bushd_ramp_bucket_entries(&ramp));
  bushd_ramp_index(&ramp, sum.data(), bucket.data());
  return ramp;
}

Result<TablePtr> make(TableContent content, std::string path) {
  if (const auto fault = check(content)) return fail(error_of(*fault, path));
  return Table::of(std::move(content), std::move(path));
}

Result<TablePtr> make_any_law(TableContent content) {
  if (const auto fault = check_all(content, check_written)) return fail(error_of(*fault, {}));
  return Table::of(std::move(content), {});
}

TablePtr Table::of(TableContent content, std::string path) {
  const std::shared_ptr<Table> table(new Table);
  table->content_hash_ = tables::content_hash(content);
  table->revision_ = content.revision;
  table->name_ = std::move(content.name);
  table->description_ = std::move(content.description);
  table->path_ = std::move(path);
  table->view_.time_unit_ns = content.time_unit_ns;
  table->view_.cruise = content.cruise.value_or(content.accel.back());
  if (content.decel) std::reverse(content.decel->begin(), content.decel->end());
  const bool symmetric = !content.decel || *content.decel == content.accel;
  table->accel_.code = std::move(content.accel);
  table->view_.accel = table->accel_.index();
  if (symmetric) {
    table->view_.decel = table->view_.accel;
  } else {
    table->decel_.code = std::move(*content.decel);
    table->view_.decel = table->decel_.index();
  }
  return table;
}

}  // namespace bushd::tables
