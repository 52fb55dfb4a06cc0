#include "messages.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <type_traits>
#include <utility>

#include "base/fields_from_json.h"
#include "base/fields_json.h"
#include "base/json_text.h"
#include "base/overloaded.h"
#include "base/printable.h"
#include "shallow_json.h"

namespace bushweb {
namespace {

using bushd::Result;
using nlohmann::json;
using nlohmann::ordered_json;

constexpr std::size_t kQuoted = 60;

std::string in_quotes(std::string_view text) {
  return "'" + bushd::printable(text.substr(0, kQuoted)) + "'";
}

// A page has no business with crates: programs have, by other doors.
template <class Type>
constexpr bool kOfPages = !std::is_same_v<Type, api::Camac>;

// The request of this name, from its fields.
template <class... Types>
Result<api::Request> request_of(std::type_identity<std::variant<Types...>> /*all*/,
                                std::string_view name, const json& fields) {
  Result<api::Request> request = bushd::fail("there is no request " + in_quotes(name));
  const auto try_type = [&]<class Type>(std::type_identity<Type>) {
    if constexpr (kOfPages<Type>) {
      if (name != Type::kName) return;
      request = bushd::from_json<Type>(fields).map(
          [](Type&& read) { return api::Request(std::move(read)); });
    }
  };
  (try_type(std::type_identity<Types>{}), ...);
  return request;
}

std::optional<std::string> text_at(const json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end() || !found->is_string()) return std::nullopt;
  return found->get<std::string>();
}

const json& object_at(const json& object, const char* name) {
  static const json kNone = json::object();
  const auto found = object.find(name);
  return found == object.end() || found->is_null() ? kNone : *found;
}

Result<Ask> ask_of(const json& told) {
  const auto daemon = text_at(told, "daemon");
  const auto name = text_at(told, "request");
  if (!daemon || !name) return bushd::fail("\"ask\" needs \"daemon\" and \"request\", both texts");
  auto request =
      request_of(std::type_identity<api::Request::variant>{}, *name, object_at(told, "fields"));
  if (!request) return bushd::fail(fmt::format("{}: {}", *name, request.error().text()));
  Ask ask{.daemon = *daemon, .request = std::move(*request)};
  const auto heard = told.find("heard");
  if (heard != told.end() && heard->is_number_integer()) ask.heard = heard->get<std::int64_t>();
  return ask;
}

template <class What>
FromPage what_of(std::int64_t id, Result<What> what) {
  if (!what) return {.id = id, .what = Wrong{what.error().text()}};
  return {.id = id, .what = std::move(*what)};
}

Text text_of(const ordered_json& message) {
  return std::make_shared<const std::string>(bushd::json_text(message));
}

ordered_json reply_json(std::int64_t id, const char* phase, std::string_view outcome,
                        std::string_view reason) {
  return {{"kind", "reply"},    {"id", id},         {"phase", phase},
          {"outcome", outcome}, {"reason", reason}, {"detail", nullptr}};
}

template <class T>
ordered_json list_of(const std::vector<T>& elements) {
  ordered_json list = ordered_json::array();
  for (const T& element : elements) list.push_back(bushd::json_of(element));
  return list;
}

ordered_json detail_json(const api::Detail& detail) {
  return std::visit(
      bushd::Overloaded{
          [](const std::monostate&) -> ordered_json { return nullptr; },
          [](const std::vector<api::MotorResult>& motors) -> ordered_json {
            return {{"motors", list_of(motors)}};
          },
          [](const api::MovePlan& plan) -> ordered_json {
            return {{"plan", bushd::json_of(plan)}};
          },
          [](const api::TableList& tables) -> ordered_json {
            return {{"tables", list_of(tables.entries)}};
          },
          [](const api::TableFile& table) -> ordered_json {
            return {{"table", bushd::json_of(table)}};
          },
          [](const api::MotionHistory& history) -> ordered_json {
            return {{"history", bushd::json_of(history)}};
          },
          [](const api::Configuration& configuration) -> ordered_json {
            return {{"configuration", bushd::json_of(configuration)}};
          },
          [](const api::CamacResult& /*of programs*/) -> ordered_json { return nullptr; },
          [](const api::ProgramList& list) -> ordered_json {
            return {{"programs", list_of(list.programs)}};
          }},
      static_cast<const api::Detail::variant&>(detail));
}

}  // namespace

FromPage parse(std::string_view text) {
  const json told = shallow_json(text);
  if (!told.is_object()) return {.id = 0, .what = Wrong{"a JSON object is expected"}};
  const auto number = told.find("id");
  if (number == told.end() || !number->is_number_integer() || number->get<std::int64_t>() <= 0) {
    return {.id = 0, .what = Wrong{"\"id\" is to be a whole number above 0"}};
  }
  const auto id = number->get<std::int64_t>();
  const std::string kind = text_at(told, "kind").value_or("");
  if (kind == "ask") return what_of(id, ask_of(told));
  if (kind == "check") {
    return what_of(id, bushd::from_json<api::TableFile>(object_at(told, "table"))
                           .map([](api::TableFile&& table) { return Check{std::move(table)}; }));
  }
  if (kind == "doctor") {
    return {.id = id, .what = Doctor{text_at(told, "daemon").value_or("")}};
  }
  return {.id = id, .what = Wrong{"there is no message of the kind " + in_quotes(kind)}};
}

bool only_reads(const api::Request& request) {
  return api::is_repeatable(request) && !api::ends_motion(request);
}

bool is_stop(const api::Request& request) {
  return std::holds_alternative<api::Stop>(request) ||
         std::holds_alternative<api::EmergencyStop>(request);
}

Text hello(std::string_view version, const Rights& rights,
           const std::vector<std::string>& daemons) {
  return text_of({{"kind", "hello"},
                  {"version", version},
                  {"user", rights.user ? ordered_json(*rights.user) : ordered_json(nullptr)},
                  {"may_command", rights.may_command},
                  {"may_stop", rights.may_stop},
                  {"daemons", daemons}});
}

Text alive(std::int64_t at) {
  return std::make_shared<const std::string>(fmt::format(R"({{"kind":"alive","at":{}}})", at));
}

Text reply(std::int64_t id, const api::Reply& reply) {
  return text_of(std::visit(
      bushd::Overloaded{[&](const api::Accepted&) { return reply_json(id, "accepted", "", ""); },
                        [&](const api::Refused& refused) {
                          return reply_json(id, "refused", "", refused.reason);
                        },
                        [&](const api::Completed& completed) {
                          ordered_json told =
                              reply_json(id, "result", word(completed.outcome), completed.reason);
                          told["detail"] = detail_json(completed.detail);
                          return told;
                        }},
      static_cast<const api::Reply::variant&>(reply)));
}

Text refused(std::int64_t id, std::string_view reason) {
  return text_of(reply_json(id, "refused", "", reason));
}

Text result(std::int64_t id, std::string_view outcome, std::string_view reason,
            const ordered_json& detail) {
  ordered_json told = reply_json(id, "result", outcome, reason);
  told["detail"] = detail;
  return text_of(told);
}

}  // namespace bushweb
