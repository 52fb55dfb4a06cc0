// What a page and bushd-web say to each other: JSON objects, as docs/web.md has them.
#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "api/reply.h"
#include "api/request.h"

namespace bushweb {

namespace api = bushd::api;

// One message. Made once and told to many pages.
using Text = std::shared_ptr<const std::string>;

// Something that the daemon of this name is asked for.
struct Ask {
  std::string daemon{};
  api::Request request{};
  // The newest `alive` that the page has heard; none: it does not say, as programs.
  std::optional<std::int64_t> heard{};
};
// What is to be said of a table that is not stored yet.
struct Check {
  api::TableFile table{};
};
// What `bushctl doctor` finds.
struct Doctor {
  std::string daemon{};
};
// It cannot be understood, and why.
struct Wrong {
  std::string why{};
};
struct FromPage {
  std::int64_t id = 0;  // the page's own count, above 0; 0: none could be read
  std::variant<Ask, Check, Doctor, Wrong> what{};
};

// Never throws, whatever the text is.
FromPage parse(std::string_view text);

// It only reads: who may not command may ask for it.
bool only_reads(const api::Request& request);
// A stop or an emergency stop: it has rights of its own.
bool is_stop(const api::Request& request);

struct Rights {
  std::optional<std::string> user{};  // of the token; none: there is none
  bool may_command = false;
  bool may_stop = false;
  friend bool operator==(const Rights&, const Rights&) = default;
};

Text hello(std::string_view version, const Rights& rights, const std::vector<std::string>& daemons);
// That bushd-web is there; `at` grows.
Text alive(std::int64_t at);
Text reply(std::int64_t id, const api::Reply& reply);
Text refused(std::int64_t id, std::string_view reason);
// A result of bushd-web's own: `detail` is an object of one member.
Text result(std::int64_t id, std::string_view outcome, std::string_view reason,
            const nlohmann::ordered_json& detail);

}  // namespace bushweb
