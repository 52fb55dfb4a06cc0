// A value of a type that declares its fields (base/fields.h) as a JSON object: its names, in its
// order. What its forms call nothing is null.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <utility>

#include "base/fields.h"

namespace bushd {

class JsonFields {
 public:
  static constexpr bool kReads = false;

  template <class T, class Form = fields::Same>
  void operator()(const fields::Field& field, const T& value, const Form& form = {}) {
    object_[field.name] = told(value, form);
  }
  template <class List, class Form = fields::Same>
  void list(const fields::Field& /*count*/, const fields::Field& field, const List& list,
            const Form& form = {}) {
    auto& array = object_[field.name] = nlohmann::ordered_json::array();
    for (const auto& element : list) array.push_back(told(element, form));
  }
  static void set(const auto& /*member*/, const auto& /*value*/) {}
  static void require(bool /*condition*/) {}

  template <class T>
  static nlohmann::ordered_json of(const T& value) {
    JsonFields json;
    T::fields(value, json);
    return std::move(json.object_);
  }

 private:
  template <class T, class Form>
  static nlohmann::ordered_json told(const T& value, const Form& form) {
    if constexpr (requires { form.nothing(value); }) {
      if (form.nothing(value)) return nullptr;
    }
    using Told = std::decay_t<decltype(form.told(value))>;
    if constexpr (std::is_arithmetic_v<Told> || std::is_same_v<Told, std::string>) {
      return form.told(value);
    } else {
      return of(form.told(value));
    }
  }

  nlohmann::ordered_json object_ = nlohmann::ordered_json::object();
};

// Precondition: T declares its fields.
template <class T>
nlohmann::ordered_json json_of(const T& value) {
  return JsonFields::of(value);
}

}  // namespace bushd
