// Keys of a section or a table, read into what they set.
#pragma once

#include <concepts>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/result.h"
#include "tables/toml_reader.h"

namespace bushd::tables {

// "is X; allowed: A" for a value of the right type.
tl::unexpected<Error> refuse(const TomlReader& reader, std::string_view key, std::string_view value,
                             std::string_view allowed);

// Which of the words stands there, counted from 0.
Result<int> read_word(const TomlReader& reader, std::string_view key,
                      std::span<const std::string_view> words);
inline Result<int> read_word(const TomlReader& reader, std::string_view key,
                             std::initializer_list<std::string_view> words) {
  return read_word(reader, key, std::span(words.begin(), words.end()));
}

// One key after the other: once one is refused, no more are read. What a key that is not there
// would set stays as it is.
class Keys {
 public:
  explicit Keys(const TomlReader& reader) : reader_(reader) {}

  Keys& only(std::initializer_list<std::string_view> keys) {
    if (result_) result_ = reader_.only(keys);
    return *this;
  }

  template <class Value>
  Keys& whole(std::string_view key, Value* value, std::int64_t least, std::int64_t most,
              std::string_view unit = {}) {
    return reader_.has(key) ? needed_whole(key, value, least, most, unit) : *this;
  }
  // Refused where it is missing.
  template <class Value>
  Keys& needed_whole(std::string_view key, Value* value, std::int64_t least, std::int64_t most,
                     std::string_view unit = {}) {
    return take(value, [&] { return reader_.integer(key, least, most, unit); });
  }

  Keys& flag(std::string_view key, bool* value) {
    return reader_.has(key) ? take(value, [&] { return reader_.boolean(key); }) : *this;
  }

  // One of a few words. Their number, from 0, is the value.
  template <class Value>
  Keys& word(std::string_view key, Value* value, std::span<const std::string_view> words) {
    return reader_.has(key) ? needed_word(key, value, words) : *this;
  }
  template <class Value>
  Keys& word(std::string_view key, Value* value, std::initializer_list<std::string_view> words) {
    return word(key, value, std::span(words.begin(), words.end()));
  }
  template <class Value>
  Keys& needed_word(std::string_view key, Value* value, std::span<const std::string_view> words) {
    return take(value, [&] { return read_word(reader_, key, words); });
  }
  template <class Value>
  Keys& needed_word(std::string_view key, Value* value,
                    std::initializer_list<std::string_view> words) {
    return needed_word(key, value, std::span(words.begin(), words.end()));
  }

  // `check`: of the number, Result<void> without a key.
  template <class Value, class Check>
  Keys& number(std::string_view key, Value* value, std::string_view allowed, Check check) {
    if (!reader_.has(key)) return *this;
    return take(value, [&]() -> Result<double> {
      auto number = reader_.number(key, allowed);
      if (!number) return number;
      if (const Result<void> good = check(*number); !good) {
        return fail(reader_.error(key, good.error().message));
      }
      return number;
    });
  }
  template <class Value>
  Keys& number(std::string_view key, Value* value, std::string_view allowed) {
    return number(key, value, allowed, [](double) { return Result<void>(); });
  }

  template <class Value, std::predicate<const std::string&> IsGood>
  Keys& text(std::string_view key, Value* value, std::string_view allowed, IsGood is_good) {
    if (!reader_.has(key)) return *this;
    return take(value, [&]() -> Result<std::string> {
      auto text = reader_.string(key, allowed);
      if (text && !is_good(*text)) return refuse(reader_, key, *text, allowed);
      return text;
    });
  }

  template <class Value>
  Keys& text(std::string_view key, Value* value, std::string_view allowed) {
    return text(key, value, allowed, [](const std::string&) { return true; });
  }

  const Result<void>& result() const { return result_; }

 private:
  template <class Value>
  struct Plain {
    using Type = Value;
  };
  template <class Value>
  struct Plain<std::optional<Value>> {
    using Type = Value;
  };

  template <class Value, class Read>
  Keys& take(Value* value, Read read) {
    if (!result_) return *this;
    auto told = read();
    if (told) {
      *value = static_cast<typename Plain<Value>::Type>(std::move(*told));
    } else {
      result_ = fail(std::move(told.error()));
    }
    return *this;
  }

  const TomlReader& reader_;
  Result<void> result_{};
};

// The elements of `[[place]]`, which is `key` of `parent`.
Result<std::vector<TomlReader>> read_elements(const TomlReader& parent, const std::string& file,
                                              std::string_view key, const std::string& place);

}  // namespace bushd::tables
