// A value of a type that declares its fields (base/fields.h) from a JSON object, as fields_json.h
// makes it. A name that is left out, or null, leaves its field as it is; counts of lists have no
// names here. What is wrong is an error that names the place: "motors[1].user: a number is
// expected".
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/fields.h"
#include "base/printable.h"
#include "base/result.h"

namespace bushd {

class FieldsFromJson {
 public:
  static constexpr bool kReads = true;

  template <class T, class Form = fields::Same>
  void operator()(const fields::Field& field, T& value, const Form& form = {}) {
    if (const auto* told = find(field.name)) take(*told, field.name, value, form);
  }
  template <class T, class Form = fields::Same>
  void list(const fields::Field& /*count*/, const fields::Field& field, std::vector<T>& list,
            const Form& form = {}) {
    const char* const name = field.name;
    const auto* told = find(name);
    if (told == nullptr) return;
    if (!told->is_array()) return wrong(name, "a list is expected");
    list.clear();
    for (std::size_t i = 0; error_.empty() && i < told->size(); ++i) {
      take((*told)[i], fmt::format("{}[{}]", name, i), list.emplace_back(), form);
    }
  }
  template <class T>
  void set(T& member, std::type_identity_t<T> value) {
    member = std::move(value);
  }
  void require(bool condition) {
    if (!condition) wrong("", "this does not mean anything");
  }

  // Fails also where the object has names that are no fields.
  template <class T>
  static Result<T> of(const nlohmann::json& object) {
    T value{};
    FieldsFromJson reader(object, "");
    reader.read(value);
    if (!reader.error_.empty()) return fail(std::move(reader.error_));
    return value;
  }

 private:
  FieldsFromJson(const nlohmann::json& object, std::string place)
      : object_(object), place_(std::move(place)) {}

  template <class T>
  void read(T& value) {
    if (!object_.is_object()) return wrong("", "an object is expected");
    T::fields(value, *this);
    if (!error_.empty()) return;
    for (const auto& [name, member] : object_.items()) {
      if (std::ranges::find(seen_, name) == seen_.end())
        return wrong(name, "there is no such field");
    }
  }

  const nlohmann::json* find(const char* name) {
    if (!error_.empty()) return nullptr;
    seen_.emplace_back(name);
    const auto found = object_.find(name);
    return found == object_.end() || found->is_null() ? nullptr : &*found;
  }

  template <class T, class Form>
  void take(const nlohmann::json& told, const std::string& name, T& value, const Form& form) {
    using Told = std::decay_t<decltype(form.told(value))>;
    Told read{};
    if constexpr (!std::is_arithmetic_v<Told> && !std::same_as<Told, std::string>) {
      FieldsFromJson within(told, place_of(name));
      within.read(read);
      if (!within.error_.empty()) {
        error_ = std::move(within.error_);
        return;
      }
    } else if (const char* expected = get(told, read)) {
      return wrong(name, expected);
    }
    if (!form.taken(std::move(read), value)) wrong(name, "this value is not allowed");
  }

  // Nullptr, or what it should be.
  static const char* get(const nlohmann::json& told, bool& value) {
    if (!told.is_boolean()) return "true or false is expected";
    value = told.get<bool>();
    return nullptr;
  }
  static const char* get(const nlohmann::json& told, std::string& value) {
    if (!told.is_string()) return "a text is expected";
    value = told.get<std::string>();
    return nullptr;
  }
  static const char* get(const nlohmann::json& told, double& value) {
    if (!told.is_number()) return "a number is expected";
    value = told.get<double>();
    return std::isfinite(value) ? nullptr : "a finite number is expected";
  }
  template <std::integral T>
  static const char* get(const nlohmann::json& told, T& value) {
    constexpr const char* kExpected = "a whole number in its range is expected";
    const auto fits = [&](auto number) {
      value = static_cast<T>(number);
      return std::in_range<T>(number) ? nullptr : kExpected;
    };
    if (told.is_number_unsigned()) return fits(told.get<std::uint64_t>());
    if (told.is_number_integer()) return fits(told.get<std::int64_t>());
    return kExpected;
  }

  std::string place_of(std::string_view name) const {
    if (place_.empty() || name.empty()) return place_ + std::string(name);
    return place_ + "." + std::string(name);
  }
  void wrong(std::string_view name, std::string_view what) {
    const std::string place = printable(place_of(name));
    if (error_.empty())
      error_ = place.empty() ? std::string(what) : fmt::format("{}: {}", place, what);
  }

  const nlohmann::json& object_;
  std::string place_;
  std::vector<std::string_view> seen_{};
  std::string error_{};
};

// Precondition: T declares its fields.
template <class T>
Result<T> from_json(const nlohmann::json& object) {
  return FieldsFromJson::of<T>(object);
}

}  // namespace bushd
