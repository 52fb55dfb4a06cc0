// The name of a type of messages, as its .lcm file has it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string_view>

namespace bushd::test {

// A text that a template can be told.
struct FixedText {
  static constexpr std::size_t kLongest = 63;
  char text[kLongest + 1]{};

  constexpr FixedText() = default;
  constexpr explicit FixedText(std::string_view given) { std::ranges::copy(given, text); }
  // NOLINTNEXTLINE(google-explicit-constructor): the argument of a template is a literal.
  constexpr FixedText(const char* given) : FixedText(std::string_view(given)) {}
  constexpr std::string_view view() const { return text; }
};

// Which type tells what a message is: its content, if it has one.
template <class T>
struct AboutOf {
  using Type = T;
};
template <class T>
  requires requires { typename T::About; }
struct AboutOf<T> : AboutOf<typename T::About> {};
template <class T>
using About = typename AboutOf<T>::Type;

template <class T>
consteval FixedText type_name() {
  std::string_view words;
  if constexpr (requires { About<T>::kMessage; }) {
    words = About<T>::kMessage;
  } else {
    words = About<T>::kName;
  }
  FixedText name(words);
  std::ranges::replace(name.text, ' ', '_');
  std::ranges::copy(std::string_view("_t"), name.text + words.size());
  return name;
}
template <class T>
inline constexpr FixedText kTypeName = type_name<T>();

}  // namespace bushd::test
