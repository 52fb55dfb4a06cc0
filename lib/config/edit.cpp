#include "config/edit.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/config.h"
#include "tables/toml_file.h"
#include "tables/toml_text.h"

namespace bushd::config {
namespace {

using tables::TomlText;

struct Span {
  std::size_t begin;
  std::size_t end;
};

tl::unexpected<Error> cannot(const std::string& motor, SettingKey key, const std::string& path) {
  return fail(Error{
      .message = fmt::format("{} of motor \"{}\" is written in a way that cannot be changed in "
                             "place; write one key a line, or change it by hand",
                             name_of(key), motor),
      .file = path});
}

// What a value is in TOML.
std::string toml_text(SettingKey key, const std::string& value) {
  return is_word(key) ? "\"" + value + "\"" : value;
}

// Such a value has no key.
bool is_none(std::string_view value) {
  return value == "none";
}

Span value_span(const TomlText& text, const toml::node& node) {
  return {text.offset(node.source().begin), text.value_end(node)};
}

toml::table* motor_in(toml::table& document, const std::string& name) {
  toml::array* motors = document["motor"].as_array();
  if (motors == nullptr) return nullptr;
  for (toml::node& node : *motors) {
    toml::table* motor = node.as_table();
    if (motor != nullptr && (*motor)["name"].value_or(std::string()) == name) return motor;
  }
  return nullptr;
}

// MCUs have no name; they are counted as in the file.
toml::table* mcu_in(toml::table& document, McuId mcu) {
  toml::array* const mcus = document["mcu"].as_array();
  if (mcus == nullptr || mcu.value >= mcus->size()) return nullptr;
  return mcus->get(mcu.value)->as_table();
}

// One edit of a text.
class Editing {
 public:
  Editing(std::string_view text, const toml::table& section) : toml_(text), section_(section) {}

  std::optional<std::string> set(SettingKey key, const std::string& value) const {
    const toml::node* node = section_.get(name_of(key));
    const bool none = is_none(value);
    if (node == nullptr) return none ? std::string(toml_.text()) : add(key, value);
    if (none) return remove(key, *node);
    return replaced(value_span(toml_, *node), toml_text(key, value));
  }

 private:
  std::string replaced(Span place, std::string_view with) const {
    std::string out(toml_.text());
    return out.replace(place.begin, place.end - place.begin, with);
  }

  // A line behind the last one of the section's own keys.
  std::optional<std::string> add(SettingKey key, const std::string& value) const {
    if (section_.is_inline()) return std::nullopt;
    std::size_t at = 0;
    for (const auto& [name, node] : section_) {
      if (const toml::table* table = node.as_table(); table != nullptr && !table->is_inline()) {
        continue;
      }
      const Span place = value_span(toml_, node);
      at = std::max(at, node.is_table() ? place.begin : place.end);
    }
    at = toml_.line_end(at);
    const std::string_view text = toml_.text();
    const bool crlf = text.find("\r\n") != std::string_view::npos;
    const char* const newline = crlf ? "\r\n" : "\n";
    const bool unended = at > 0 && text[at - 1] != '\n';
    return replaced({at, at}, fmt::format("{}{} = {}{}", unended ? newline : "", name_of(key),
                                          toml_text(key, value), newline));
  }

  // Its lines, but for what people have written beside it.
  std::optional<std::string> remove(SettingKey key, const toml::node& node) const {
    if (section_.is_inline()) return std::nullopt;
    const std::string_view text = toml_.text();
    const Span whole{
        toml_.line_begin(toml_.offset(section_.find(name_of(key))->first.source().begin)),
        toml_.line_end(value_span(toml_, node).end)};
    std::string comments;
    for (std::size_t at = whole.begin; at < whole.end; ++at) {
      if (text[at] != '#') continue;
      const std::size_t end = toml_.line_end(at);
      comments += text.substr(at, end - at);
      at = end - 1;
    }
    return replaced(whole, comments);
  }

  TomlText toml_;
  const toml::table& section_;
};

// What the document has to be afterwards.
Result<void> put(toml::table& section, const Edit& edit) {
  if (is_none(edit.value)) {
    section.erase(name_of(edit.key));
    return {};
  }
  const std::string key(name_of(edit.key));
  const auto value = tables::parse_toml(key + " = " + toml_text(edit.key, edit.value), key);
  if (!value) return fail(value.error());
  section.insert_or_assign(key, *value->get(key));
  return {};
}

Result<std::string> edited_once(const std::string& text, const Edit& edit, McuId mcu,
                                const std::string& path) {
  auto before = tables::parse_toml(text, path);
  if (!before) return fail(before.error());
  toml::table* section = is_of_mcu(edit.key) ? mcu_in(*before, mcu) : motor_in(*before, edit.motor);
  if (section == nullptr) return cannot(edit.motor, edit.key, path);
  auto out = Editing(text, *section).set(edit.key, edit.value);
  if (!out) return cannot(edit.motor, edit.key, path);
  if (const auto done = put(*section, edit); !done) return fail(done.error());
  const auto after = tables::parse_toml(*out, path);
  if (!after || *after != *before) return cannot(edit.motor, edit.key, path);
  return std::move(*out);
}

}  // namespace

Result<std::string> edited(std::string_view text, std::span<const Edit> edits,
                           const std::string& path) {
  const auto config = parse(text, path);
  if (!config) return fail(config.error());
  // One may need another: a velocity is of a motor that people move. Keys are in that order.
  std::vector<Edit> in_order(edits.begin(), edits.end());
  std::ranges::stable_sort(in_order, {}, [](const Edit& edit) {
    return std::pair(!goes_first(edit.key, edit.value), edit.key);
  });
  std::map<std::string, Settings> changed;  // by motor
  std::string out(text);
  for (Edit& edit : in_order) {
    const auto motor = std::ranges::find(config->motors, edit.motor, &Motor::name);
    if (motor == config->motors.end()) {
      return fail(Error{.message = "has no motor \"" + edit.motor + "\"", .file = path});
    }
    Settings& now =
        changed.try_emplace(edit.motor, settings_of(*motor, config->mcu_of(*motor))).first->second;
    auto settings = with(now, edit.key, edit.value);
    if (!settings) return fail(edit.motor + ": " + settings.error().message);
    now = std::move(*settings);
    edit.value = text_of(now, edit.key);
    auto next = edited_once(out, edit, motor->mcu, path);
    if (!next) return next;
    out = std::move(*next);
  }
  if (auto good = parse(out, path); !good) return fail(good.error());
  return out;
}

}  // namespace bushd::config
