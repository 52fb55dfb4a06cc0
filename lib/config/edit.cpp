#include "config/edit.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "config/config.h"
#include "tables/toml_file.h"

namespace bushd::config {
namespace {

// Lines of a document, and the places in them that toml++ tells: it counts columns in code points.
class Lines {
 public:
  explicit Lines(std::string_view text) : text_(text) {
    begins_.push_back(0);
    for (std::size_t i = 0; i < text.size(); ++i) {
      if (text[i] == '\n') begins_.push_back(i + 1);
    }
  }
  std::size_t offset(const toml::source_position& position) const {
    std::size_t at = begins_.at(position.line - 1);
    for (std::size_t column = 1; column < position.column; ++column) {
      do ++at;
      while (at < text_.size() && (static_cast<unsigned char>(text_[at]) & 0xC0) == 0x80);
    }
    return std::min(at, text_.size());
  }
  std::size_t begin_of_line(std::size_t at) const {
    return *std::prev(std::ranges::upper_bound(begins_, at));
  }
  // Behind its newline, if there is one.
  std::size_t end_of_line(std::size_t at) const {
    const std::size_t newline = text_.find('\n', at);
    return newline == std::string_view::npos ? text_.size() : newline + 1;
  }
  std::string_view text() const { return text_; }

 private:
  std::string_view text_;
  std::vector<std::size_t> begins_;
};

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
  return key == SettingKey::kDirection ? "\"" + value + "\"" : value;
}

// A scalar or an array, where its text stands. toml++ tells where a scalar begins and strings end;
// numbers end with their token, arrays behind their bracket.
std::optional<Span> value_span(const Lines& lines, const toml::node& node) {
  const std::string_view text = lines.text();
  const std::size_t begin = lines.offset(node.source().begin);
  if (node.is_string()) return Span{begin, lines.offset(node.source().end)};
  const auto token_end = [&](std::size_t at) {
    return std::min(text.find_first_of(" \t\r\n,]#}", at), text.size());
  };
  const toml::array* array = node.as_array();
  if (array == nullptr) return Span{begin, token_end(begin)};
  if (array->empty()) return std::nullopt;
  std::size_t at = token_end(lines.offset(array->back().source().begin));
  while (at < text.size() && text[at] != ']') {
    at = text[at] == '#' ? std::min(text.find('\n', at), text.size()) : at + 1;
  }
  if (at >= text.size()) return std::nullopt;
  return Span{begin, at + 1};
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

// One edit of a text.
class Editing {
 public:
  Editing(std::string_view text, const toml::table& motor) : lines_(text), motor_(motor) {}

  std::optional<std::string> set(SettingKey key, const std::string& value) const {
    const toml::node* node = motor_.get(name_of(key));
    const bool none = key == SettingKey::kSoftLimits && value == "none";
    if (node == nullptr) return none ? std::string(lines_.text()) : add(key, value);
    if (none) return remove(key, *node);
    const auto place = value_span(lines_, *node);
    if (!place) return std::nullopt;
    return replaced(*place, toml_text(key, value));
  }

 private:
  std::string replaced(Span place, std::string_view with) const {
    std::string out(lines_.text());
    return out.replace(place.begin, place.end - place.begin, with);
  }

  // A line behind the last one of the section's own keys.
  std::optional<std::string> add(SettingKey key, const std::string& value) const {
    if (motor_.is_inline()) return std::nullopt;
    std::size_t at = 0;
    for (const auto& [name, node] : motor_) {
      if (const toml::table* table = node.as_table(); table != nullptr && !table->is_inline()) {
        continue;
      }
      at = std::max(at, lines_.offset(node.source().begin));
      if (const auto place = value_span(lines_, node); place && !node.is_table()) {
        at = std::max(at, place->end);
      }
    }
    at = lines_.end_of_line(at);
    const std::string_view text = lines_.text();
    const bool crlf = text.find("\r\n") != std::string_view::npos;
    const char* const newline = crlf ? "\r\n" : "\n";
    const bool unended = at > 0 && text[at - 1] != '\n';
    return replaced({at, at}, fmt::format("{}{} = {}{}", unended ? newline : "", name_of(key),
                                          toml_text(key, value), newline));
  }

  // Its lines, but for what people have written beside it.
  std::optional<std::string> remove(SettingKey key, const toml::node& node) const {
    const auto place = value_span(lines_, node);
    if (!place || motor_.is_inline()) return std::nullopt;
    const std::string_view text = lines_.text();
    const Span whole{
        lines_.begin_of_line(lines_.offset(motor_.find(name_of(key))->first.source().begin)),
        lines_.end_of_line(place->end)};
    std::string comments;
    for (std::size_t at = whole.begin; at < whole.end; ++at) {
      if (text[at] != '#') continue;
      const std::size_t end = lines_.end_of_line(at);
      comments += text.substr(at, end - at);
      at = end - 1;
    }
    return replaced(whole, comments);
  }

  Lines lines_;
  const toml::table& motor_;
};

// What the document has to be afterwards.
Result<void> put(toml::table& motor, const Edit& edit) {
  if (edit.key == SettingKey::kSoftLimits && edit.value == "none") {
    motor.erase(name_of(edit.key));
    return {};
  }
  const std::string key(name_of(edit.key));
  const auto value = tables::parse_toml(key + " = " + toml_text(edit.key, edit.value), key);
  if (!value) return fail(value.error());
  motor.insert_or_assign(key, *value->get(key));
  return {};
}

Result<std::string> edited_once(const std::string& text, const Edit& edit,
                                const std::string& path) {
  auto before = tables::parse_toml(text, path);
  if (!before) return fail(before.error());
  toml::table* motor = motor_in(*before, edit.motor);
  if (motor == nullptr) return cannot(edit.motor, edit.key, path);
  auto out = Editing(text, *motor).set(edit.key, edit.value);
  if (!out) return cannot(edit.motor, edit.key, path);
  if (const auto done = put(*motor, edit); !done) return fail(done.error());
  const auto after = tables::parse_toml(*out, path);
  if (!after || *after != *before) return cannot(edit.motor, edit.key, path);
  return std::move(*out);
}

}  // namespace

Result<std::string> edited(std::string_view text, std::span<const Edit> edits,
                           const std::string& path) {
  const auto config = parse(text, path);
  if (!config) return fail(config.error());
  std::string out(text);
  for (Edit edit : edits) {
    const auto motor = std::ranges::find(config->motors, edit.motor, &Motor::name);
    if (motor == config->motors.end()) {
      return fail(Error{.message = "has no motor \"" + edit.motor + "\"", .file = path});
    }
    const auto settings = with({motor->coordinates, motor->soft_limits}, edit.key, edit.value);
    if (!settings) return fail(edit.motor + ": " + settings.error().message);
    edit.value = text_of(*settings, edit.key);
    auto next = edited_once(out, edit, path);
    if (!next) return next;
    out = std::move(*next);
  }
  if (auto good = parse(out, path); !good) return fail(good.error());
  return out;
}

}  // namespace bushd::config
