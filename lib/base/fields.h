// How a type of requests, replies and snapshots declares its fields: once, in its header.
//
//   static void fields(auto& self, auto& visit) {
//     visit("motor", self.motor);
//     visit("keepalive_ms", self.keepalive_ms);
//     visit("steps_after", self.steps_after, fields::NoneIs<std::int64_t>{-1});
//   }
//
// Names and order are those of its .lcm file. Whoever does something with all fields of a type
// writes a visitor: lib/lcm/wire.h has those that write, read and fingerprint LCM's bytes.
//
// What a visitor can be asked:
//
// visit(name, member) or visit(name, member, form): a bool, a number, a text, or a type with
// fields.
//
// visit.list(count, name, vector) or with a form: a vector, one element after the other.
//
// visit.set(member, value): does something in a visitor that reads only. For a member that is made
// of several fields, which are visited as local variables before.
//
// visit.require(condition): if it is false, what is read is no message of this type.
//
// `self` may be const, and a default object. Arguments of set() and require() are evaluated by
// every visitor; what is dear is done where Visitor::kReads only. Local variables begin as `self`
// says, since a visitor that writes takes their values.
//
// lib/base/fields_json.h has the one that makes JSON.
//
// A form converts a member to another type and back. told(value) is what is told of it; taken(told,
// value) puts it back, and returns false for what is not allowed. nothing(value), optional: true
// where the member has no value; told() gives something in its place then. A form is made before a
// visitor that reads has read the field. An unsigned number of 32 or 64 bits without a form is told
// by the signed one of the same bits.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

namespace bushd::fields {

// As it is.
struct Same {
  static const auto& told(const auto& value) { return value; }
  template <class T>
  static bool taken(T&& told, std::decay_t<T>& value) {
    value = std::forward<T>(told);
    return true;
  }
};

// As it is, where it means something.
struct If : Same {
  bool meant;
  constexpr explicit If(bool condition) : meant(condition) {}
  bool nothing(const auto& /*value*/) const { return !meant; }
};

// An integer as one of another type; what does not fit means nothing.
template <class Told>
struct As {
  static Told told(auto value) { return static_cast<Told>(value); }
  template <class T>
  static bool taken(Told told, T& value) {
    value = static_cast<T>(told);
    return std::in_range<T>(told);
  }
};

// An integer as one of another type; 0 for what is not in 0..most.
template <class Told>
struct OrZero {
  Told most;
  static Told told(auto value) { return static_cast<Told>(value); }
  template <class T>
  bool taken(Told told, T& value) const {
    value = told < 0 || told > most ? T{0} : static_cast<T>(told);
    return true;
  }
};

// An optional number; none is told as this one.
template <class Told>
struct NoneIs {
  Told none;
  static bool nothing(const auto& value) { return !value; }
  template <class T>
  Told told(const std::optional<T>& value) const {
    return value ? static_cast<Told>(*value) : none;
  }
  template <class T>
  bool taken(Told told, std::optional<T>& value) const {
    value = told == none ? std::optional<T>{} : std::optional<T>{static_cast<T>(told)};
    return true;
  }
};

// The same of numbers that are not negative: any negative one is none, and -1 is told.
template <class Told>
struct NegativeIsNone {
  static bool nothing(const auto& value) { return !value; }
  template <class T>
  static Told told(const std::optional<T>& value) {
    return value ? static_cast<Told>(*value) : Told{-1};
  }
  template <class T>
  static bool taken(Told told, std::optional<T>& value) {
    value = told < 0 ? std::optional<T>{} : std::optional<T>{static_cast<T>(told)};
    return true;
  }
};

// One of the first `kCount` of an enumeration, counted from 1.
template <int kCount>
struct OneOf {
  static std::int8_t told(auto value) {
    return static_cast<std::int8_t>(static_cast<int>(value) + 1);
  }
  template <class T>
  static bool taken(std::int8_t told, T& value) {
    value = static_cast<T>(told - 1);
    return told >= 1 && told <= kCount;
  }
};

// The same, counted from 0: the first one is that of whoever does not know the field.
template <int kCount>
struct OneFrom0 {
  static std::int8_t told(auto value) { return static_cast<std::int8_t>(value); }
  template <class T>
  static bool taken(std::int8_t told, T& value) {
    value = static_cast<T>(told);
    return told >= 0 && told < kCount;
  }
};

// By its word: word(value), and back by `parse`.
template <class Parse>
struct Word {
  Parse parse;
  static std::string told(const auto& value) { return std::string(word(value)); }
  template <class T>
  bool taken(std::string_view told, T& value) const {
    const std::optional<T> known = parse(told);
    if (known) value = *known;
    return known.has_value();
  }
};
template <class Parse>
Word(Parse) -> Word<Parse>;

}  // namespace bushd::fields
