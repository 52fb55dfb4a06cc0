// How a type of requests, replies and snapshots declares its fields: once, in its header, with all
// that is told of them.
//
//   static constexpr std::string_view kName = "jog";
//   static constexpr std::string_view kMeaning = "A motor moves on at this speed ...";
//   static constexpr std::string_view kResult = "done, ...";  // of requests
//   static void fields(auto& self, auto& visit) {
//     visit("motor", self.motor);
//     visit({"speed", fields::Unit{"unit/s"}, "signed; 0 ends the jog"}, self.per_s);
//     visit({"keepalive_ms", "it is ramped down then", kKeepaliveMs}, self.keepalive_ms);
//     visit({"steps_after", "-1: as soon as possible"}, self.steps_after, kNoneIsMinus1);
//   }
//
// Whoever does something with all fields of a type writes a visitor: lib/lcm/wire.h has those that
// write, read and fingerprint LCM's bytes, tests/lcm/type_description.h the one that tells what a
// type is, of which the .lcm files and docs/messages.md are made. The order is that of the bytes.
//
// What a visitor can be asked:
//
// visit(field, member) or visit(field, member, form): a bool, a number, a text, or a type with
// fields. A field is its name, or {name, unit, meaning, range}, of which all but the name may be
// left out.
//
// visit.list(count, field, vector) or with a form: a vector, one element after the other. `count`
// is a field too, the number of elements.
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
// where the member has no value; told() gives something in its place then. constants(), optional:
// the numbers that have names. A form is made before a visitor that reads has read the field. An
// unsigned number of 32 or 64 bits without a form is told by the signed one of the same bits.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

namespace bushd::fields {

// From least to most, both included: one constant for who checks and who tells.
template <class T>
struct Range {
  T least;
  T most;
  constexpr bool has(T value) const { return value >= least && value <= most; }
};

// Where the name of a field does not end with its unit.
struct Unit {
  const char* text;
};

struct Field {
  const char* name;
  Unit unit{""};
  const char* meaning = "";
  Range<double> range{};  // of numbers far below 2^53
  bool has_range = false;

  // NOLINTNEXTLINE(google-explicit-constructor): most fields are told by their names alone.
  constexpr Field(const char* its_name) : name(its_name) {}
  constexpr Field(const char* its_name, const char* its_meaning)
      : name(its_name), meaning(its_meaning) {}
  constexpr Field(const char* its_name, Unit its_unit, const char* its_meaning = "")
      : name(its_name), unit(its_unit), meaning(its_meaning) {}
  template <class T>
  constexpr Field(const char* its_name, const char* its_meaning, Range<T> its_range)
      : Field(its_name, Unit{""}, its_meaning, its_range) {}
  template <class T>
  constexpr Field(const char* its_name, Unit its_unit, const char* its_meaning, Range<T> its_range)
      : name(its_name),
        unit(its_unit),
        meaning(its_meaning),
        range{static_cast<double>(its_range.least), static_cast<double>(its_range.most)},
        has_range(true) {}
};

// A number of an enumeration, or of a sum of bits, as it is named where the number is told.
struct Constant {
  const char* name;
  const char* meaning = "";
};

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

// As above, of numbers that are not negative: any negative one is none, and -1 is told.
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

// One of an enumeration, whose constants are these, in this order. The first one is told as
// `kFirst`.
template <int kFirst, std::size_t kCount>
struct Enumeration {
  std::array<Constant, kCount> all{};
  constexpr explicit Enumeration(const Constant (&constants)[kCount]) {
    for (std::size_t i = 0; i < kCount; ++i) all[i] = constants[i];
  }
  static std::int8_t told(auto value) {
    return static_cast<std::int8_t>(static_cast<int>(value) + kFirst);
  }
  template <class T>
  static bool taken(std::int8_t told, T& value) {
    value = static_cast<T>(told - kFirst);
    return told >= kFirst && told < kFirst + static_cast<int>(kCount);
  }
  std::array<std::pair<int, Constant>, kCount> constants() const {
    std::array<std::pair<int, Constant>, kCount> numbered;
    for (std::size_t i = 0; i < kCount; ++i) numbered[i] = {kFirst + static_cast<int>(i), all[i]};
    return numbered;
  }
};
template <std::size_t kCount>
struct OneOf : Enumeration<1, kCount> {
  constexpr explicit OneOf(const Constant (&constants)[kCount])
      : Enumeration<1, kCount>(constants) {}
};
// 0, the first one, is that of whoever does not know the field.
template <std::size_t kCount>
struct OneFrom0 : Enumeration<0, kCount> {
  constexpr explicit OneFrom0(const Constant (&constants)[kCount])
      : Enumeration<0, kCount>(constants) {}
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
