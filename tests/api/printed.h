// What tests print of requests and replies that differ: JSON of their fields. To be included
// wherever they are compared.
#pragma once

#include <ostream>
#include <variant>
#include <vector>

#include "api/reply.h"
#include "api/request.h"
#include "base/fields_json.h"
#include "base/json_text.h"
#include "base/overloaded.h"
#include "base/result.h"

namespace bushd::api {

template <class Asked>
concept IsRequest = requires(const Asked& asked) { asked.motion(); };

template <IsRequest Asked>
void PrintTo(const Asked& asked, std::ostream* out) {
  *out << Asked::kName << " " << json_text(json_of(asked));
}
inline void PrintTo(const Request& request, std::ostream* out) {
  std::visit([out](const auto& asked) { PrintTo(asked, out); },
             static_cast<const Request::variant&>(request));
}
template <IsRequest Asked>
void PrintTo(const Result<Asked>& asked, std::ostream* out) {
  if (asked) return PrintTo(*asked, out);
  *out << "error: " << asked.error().text();
}

inline void PrintTo(const Detail& detail, std::ostream* out) {
  const auto print = [out](const auto& told) { *out << json_text(json_of(told)) << " "; };
  const auto print_each = [&print](const auto& list) {
    for (const auto& told : list) print(told);
  };
  std::visit(Overloaded{[](std::monostate) {}, print,
                        [&](const std::vector<MotorResult>& motors) { print_each(motors); },
                        [&](const TableList& tables) { print_each(tables.entries); }},
             static_cast<const Detail::variant&>(detail));
}
inline void PrintTo(const Reply& reply, std::ostream* out) {
  const auto* completed = std::get_if<Completed>(&reply);
  if (completed == nullptr) {
    *out << (is_final(reply) ? "refused: " : "accepted ") << reason_of(reply);
    return;
  }
  *out << word(completed->outcome) << ", " << completed->reason << " ";
  PrintTo(completed->detail, out);
}

}  // namespace bushd::api
