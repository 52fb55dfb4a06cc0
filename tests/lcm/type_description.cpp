#include "lcm/type_description.h"

#include <array>

namespace bushd::test {
namespace {

constexpr std::size_t kColumns = 120;

template <class... Content>
void add_requests(TypeDescriptions& types, const std::variant<Content...>* /*requests*/) {
  (Describe::type<lcm::RequestMessage<Content>>(types, lcm::channel_of_request(Content::kName),
                                                Sender::kClients),
   ...);
}

// In lines of so many columns, each behind `begin`.
std::string wrapped(std::string_view text, const std::string& begin) {
  std::string out;
  while (!text.empty()) {
    std::size_t end = text.size();
    if (begin.size() + end > kColumns) {
      end = text.rfind(' ', kColumns - begin.size());
      if (end == std::string_view::npos) end = std::min(text.find(' '), text.size());
    }
    out += begin + std::string(text.substr(0, end)) + "\n";
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return out;
}

// A line with what is told of it: behind it, or before it where that would be too long.
std::string line(const std::string& code, const std::string& told, std::size_t column) {
  const std::string line = fmt::format("  {};", code);
  if (told.empty()) return line + "\n";
  const std::string padded = fmt::format("{:<{}}  // {}", line, column, told);
  if (padded.size() <= kColumns) return padded + "\n";
  return wrapped(told, "  // ") + line + "\n";
}

std::string code_of(const FieldDescription& field) {
  return field.type + " " + field.name + (field.count.empty() ? "" : "[" + field.count + "]");
}

std::string code_of(const ConstantDescription& constant) {
  return fmt::format("const int8_t {} = {}", constant.name, constant.value);
}

std::string told_of(const FieldDescription& field) {
  const std::string number =
      field.unit + (field.unit.empty() || field.range.empty() ? "" : ", ") + field.range;
  return number + (number.empty() || field.meaning.empty() ? "" : "; ") + field.meaning;
}

std::string about(const TypeDescription& type) {
  const std::string result = type.result.empty() ? "" : " Result: " + type.result + ".";
  return type.meaning + result +
         (type.sender != Sender::kClients || type.needs_session ||
                  type.meaning.find("session") != std::string::npos
              ? ""
              : " Needs no session.");
}

std::string unit_of(const FieldDescription& field) {
  if (!field.unit.empty() || field.type == "boolean") return field.unit;
  const std::string_view name = field.name;
  using Ending = std::pair<std::string_view, std::string_view>;
  static constexpr std::array<Ending, 9> kEndings = {{{"utime_us", "us since 1970"},
                                                      {"_us", "us"},
                                                      {"_ns", "ns"},
                                                      {"_ms", "ms"},
                                                      {"steps_per_s", "steps/s"},
                                                      {"bytes_per_s", "bytes/s"},
                                                      {"_s", "s"},
                                                      {"_steps", "steps"},
                                                      {"_ppm", "ppm"}}};
  for (const auto& [ending, unit] : kEndings) {
    if (name.ends_with(ending)) return std::string(unit);
  }
  return name.ends_with("ticks") ? "ticks" : "";
}

std::string cell(std::string text) {
  for (std::size_t at = 0; (at = text.find_first_of("|<", at)) != std::string::npos; at += 2) {
    text.insert(at, 1, '\\');
  }
  return text;
}

std::string link(const std::string& type) {
  return type.ends_with("_t") && type.find("int") != 0 ? fmt::format("[`{0}`](#{0})", type)
                                                       : "`" + type + "`";
}

std::string row(const FieldDescription& field) {
  std::string meaning = field.meaning;
  for (const ConstantDescription& constant : field.constants) {
    if (!meaning.empty()) meaning += meaning.ends_with(';') ? " " : "; ";
    meaning += fmt::format("`{}` = {}", constant.name, constant.value);
    if (!constant.meaning.empty()) meaning += ": " + constant.meaning;
  }
  const std::string array = field.count.empty() ? "" : fmt::format(" [`{}`]", field.count);
  return fmt::format("| `{}` | {}{} | {} | {} | {} |\n", field.name, link(field.type), array,
                     unit_of(field), field.range, cell(meaning));
}

std::string section(const TypeDescription& type) {
  std::string out = fmt::format("\n### {}\n\n", type.name);
  if (!type.channel.empty()) out += fmt::format("Channel `{}`. ", type.channel);
  out += cell(about(type)) +
         "\n\n| field | type | unit | range | meaning |\n| --- | --- | --- | --- | --- |\n";
  for (const FieldDescription& field : type.fields) out += row(field);
  return out;
}

}  // namespace

std::vector<std::string> words_in_quotes(std::string_view meaning) {
  std::vector<std::string> words;
  std::size_t at = 0;
  while ((at = meaning.find('"', at)) != std::string_view::npos) {
    const std::size_t end = meaning.find('"', at + 1);
    if (end == std::string_view::npos) break;
    words.emplace_back(meaning.substr(at + 1, end - at - 1));
    at = end + 1;
  }
  return words;
}

TypeDescriptions all_types() {
  TypeDescriptions types;
  add_requests(types, static_cast<const api::Request::variant*>(nullptr));
  lcm::for_each_message(lcm::kOfClients, [&]<class Message>(const lcm::On<Message>& on) {
    Describe::type<Message>(types, on.channel, Sender::kClients);
  });
  lcm::for_each_message(lcm::kOfDaemon, [&]<class Message>(const lcm::On<Message>& on) {
    Describe::type<Message>(types, on.channel, Sender::kDaemon);
  });
  std::ranges::sort(types, {}, &TypeDescription::name);
  return types;
}

std::string lcm_file(const TypeDescription& type) {
  const std::string channel =
      type.channel.empty() ? "" : fmt::format("Channel <prefix>_{}. ", type.channel);
  std::string out = "package bushd;\n\n" + wrapped(channel + about(type), "// ");
  out += fmt::format("struct {} {{\n", type.name);
  std::size_t column = 0;
  for (const FieldDescription& field : type.fields) {
    column = std::max(column, code_of(field).size() + 3);
    for (const auto& constant : field.constants) {
      column = std::max(column, code_of(constant).size() + 3);
    }
  }
  for (const FieldDescription& field : type.fields) {
    out += line(code_of(field), told_of(field), column);
    for (const auto& constant : field.constants) {
      out += line(code_of(constant), constant.meaning, column);
    }
  }
  return out + "}\n";
}

std::string page(const TypeDescriptions& types) {
  std::string out = R"(# Messages

Every type of message, field by field, as [`lib/lcm/types`](../lib/lcm/types) has them for lcm-gen. [LCM and the control
socket](lcm.md) says how they are used. This page and these files are [made](../CONTRIBUTING.md#a-new-field-of-a-state-or-an-answer) of what
the types in `lib/api` and `lib/lcm` declare.

A field that counts a list stands before it. A range is what the daemon takes, or tells. A unit is left out where there is none.

## Channels
)";
  for (const auto& [sender, title] :
       {std::pair{Sender::kClients, "clients"}, std::pair{Sender::kDaemon, "the daemon"}}) {
    out += fmt::format("\nOf {}:\n\n| channel | type | |\n| --- | --- | --- |\n", title);
    for (const TypeDescription& type : types) {
      if (type.sender != sender) continue;
      const std::string first = type.meaning.substr(0, type.meaning.find(". "));
      out += fmt::format("| `{}` | {} | {} |\n", type.channel, link(type.name),
                         cell(first.ends_with('.') ? first.substr(0, first.size() - 1) : first));
    }
  }
  out += "\n## Types\n";
  for (const TypeDescription& type : types) out += section(type);
  return out;
}

}  // namespace bushd::test
