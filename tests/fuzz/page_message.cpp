// Any text as a message of a page: it is wrong with a reason, or a request that daemons can be sent
// and that means the same when it is told as JSON again.
#include <nlohmann/json.hpp>
#include <string_view>
#include <variant>

#include "base/fields_from_json.h"
#include "base/fields_json.h"
#include "base/json_text.h"
#include "fuzz/fuzz.h"
#include "tools/bushweb/checks.h"
#include "tools/bushweb/messages.h"

namespace bushd::fuzz {
namespace {

template <class T>
void check_again(const T& value) {
  const std::string text = json_text(json_of(value));
  const auto told = nlohmann::json::parse(text, nullptr, false);
  BUSHD_REQUIRE(told.is_object());
  const auto read = from_json<T>(told);
  BUSHD_REQUIRE(read.has_value());
  BUSHD_REQUIRE(json_text(json_of(*read)) == text);
}

void check(std::string_view text) {
  const bushweb::FromPage message = bushweb::parse(text);
  if (const auto* wrong = std::get_if<bushweb::Wrong>(&message.what)) {
    BUSHD_REQUIRE(!wrong->why.empty());
    return;
  }
  BUSHD_REQUIRE(message.id > 0);
  if (const auto* asked = std::get_if<bushweb::Ask>(&message.what)) {
    std::visit([](const auto& request) { check_again(request); },
               static_cast<const api::Request::variant&>(asked->request));
  } else if (const auto* table = std::get_if<bushweb::Check>(&message.what)) {
    BUSHD_REQUIRE(!bushweb::checked(message.id, table->table)->empty());
  }
}

}  // namespace
}  // namespace bushd::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  bushd::fuzz::check({reinterpret_cast<const char*>(data), size});
  return 0;
}
