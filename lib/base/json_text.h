// JSON as text, of any contents. Paths, names of clients and texts of files need not be UTF-8, and
// the library's dump() throws then: what is no UTF-8 becomes U+FFFD. Nobody else calls dump().
#pragma once

#include <string>

namespace bushd {

struct JsonStyle {
  int indent = -1;  // by default all in one line
  bool ascii = false;
};

// `Json`: nlohmann::json, or nlohmann::ordered_json.
template <typename Json>
std::string json_text(const Json& json, JsonStyle style = {}) {
  return json.dump(style.indent, ' ', style.ascii, Json::error_handler_t::replace);
}

}  // namespace bushd
