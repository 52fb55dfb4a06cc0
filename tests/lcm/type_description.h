// What a type of messages is, by the fields that it declares (base/fields.h): for its .lcm file and
// its section of docs/messages.md.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "lcm/messages.h"
#include "lcm/type_name.h"

namespace bushd::test {

struct ConstantDescription {
  std::string name{};
  int value = 0;
  std::string meaning{};
};

struct FieldDescription {
  std::string type{};
  std::string name{};
  std::string count{};  // of a list: the field before it that has its length; else ""
  std::string unit{};   // where it is declared
  std::string range{};
  std::string meaning{};
  std::vector<ConstantDescription> constants{};
  std::vector<std::string> wrong_words{};  // in quotes in its meaning, and unknown to its form
};

enum class Sender { kNobody, kClients, kDaemon };  // nobody: it is within others

struct TypeDescription {
  std::string name{};
  std::string channel{};
  Sender sender = Sender::kNobody;
  std::string meaning{};
  std::string result{};  // on success, of a request
  bool needs_session = true;
  std::vector<FieldDescription> fields{};
};
using TypeDescriptions = std::vector<TypeDescription>;  // by name

std::vector<std::string> words_in_quotes(std::string_view meaning);

class Describe {
 public:
  static constexpr bool kReads = false;
  Describe(TypeDescriptions& all, TypeDescription& own) : all_(all), own_(own) {}

  template <class T, class Form = fields::Same>
  void operator()(const fields::Field& field, const T& /*value*/, const Form& form = {}) {
    add<lcm::wire::Told<Form, T>>(field, "", form);
  }
  template <class T, class Form = fields::Same>
  void list(const fields::Field& count, const fields::Field& field, const std::vector<T>& /*list*/,
            const Form& form = {}) {
    add<std::int32_t>(count, "", fields::Same{});
    add<lcm::wire::Told<Form, T>>(field, count.name, form);
  }
  static void set(const auto& /*member*/, const auto& /*value*/) {}
  static void require(bool /*condition*/) {}

  // Adds it, and the types within, unless it is there.
  template <class T>
  static void type(TypeDescriptions& all, std::string_view channel = "",
                   Sender sender = Sender::kNobody) {
    TypeDescription own{.name = std::string(kTypeName<T>.view()),
                        .channel = std::string(channel),
                        .sender = sender,
                        .meaning = std::string(About<T>::kMeaning)};
    if (std::ranges::find(all, own.name, &TypeDescription::name) != all.end()) return;
    own.needs_session = !requires { About<T>::is_repeatable(); };
    if constexpr (requires(const About<T>& about) { about.motion(); }) {
      own.needs_session = own.needs_session && !api::ends(About<T>{}.motion());
    }
    if constexpr (requires { About<T>::kResult; }) own.result = About<T>::kResult;
    const T message{};
    Describe describe(all, own);
    T::fields(message, describe);
    all.push_back(std::move(own));
  }

 private:
  template <class Told>
  void add(const fields::Field& field, const char* count, const auto& form) {
    FieldDescription own{
        .name = field.name, .count = count, .unit = field.unit.text, .meaning = field.meaning};
    if (field.has_range) {
      own.range = fmt::format("{:.15g}..{:.15g}", field.range.least, field.range.most);
    }
    if constexpr (lcm::wire::type_name<Told>().empty()) {
      own.type = std::string(kTypeName<Told>.view());
      type<Told>(all_);
    } else {
      own.type = lcm::wire::type_name<Told>();
    }
    if constexpr (requires { form.constants(); }) {
      for (const auto& [value, constant] : form.constants()) {
        own.constants.push_back({constant.name, value, constant.meaning});
      }
    }
    if constexpr (requires { form.parse(std::string_view{}); }) {
      own.wrong_words = words_in_quotes(own.meaning);
      std::erase_if(own.wrong_words, [&](const std::string& word) { return form.parse(word); });
    }
    own_.fields.push_back(std::move(own));
  }

  TypeDescriptions& all_;
  TypeDescription& own_;
};

// Every type that travels, or is within one that does.
TypeDescriptions all_types();

std::string lcm_file(const TypeDescription& type);
std::string page(const TypeDescriptions& types);

}  // namespace bushd::test
