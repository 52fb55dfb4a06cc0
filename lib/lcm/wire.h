// LCM's bytes of every type that declares its fields (base/fields.h): fingerprint, then the fields,
// numbers big-endian, a text as its length with the NUL, its characters and the NUL.
//
// Payloads come from anybody on the network. Every length is held against the bytes that are left
// before anything is allocated for it.
#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/fields.h"
#include "base/result.h"

namespace bushd::lcm {

// One message, one datagram: a fragmented message is lost as soon as one fragment is. LCM fragments
// above 65499 bytes.
inline constexpr std::size_t kMaxMessageBytes = 60 * 1024;

namespace wire {

// What a value is told by: itself, or the signed number of the same bits.
template <class T>
struct ToldBy {
  using Type = T;
};
template <std::unsigned_integral T>
  requires(sizeof(T) >= 4)
struct ToldBy<T> {
  using Type = std::make_signed_t<T>;
};

// Which of the primitive types of LCM it is; "" for a type with fields.
template <class T>
constexpr std::string_view type_name() {
  using Told = typename ToldBy<T>::Type;
  if constexpr (std::same_as<Told, bool>) {
    return "boolean";
  } else if constexpr (std::same_as<Told, std::int8_t>) {
    return "int8_t";
  } else if constexpr (std::same_as<Told, std::int16_t>) {
    return "int16_t";
  } else if constexpr (std::same_as<Told, std::int32_t>) {
    return "int32_t";
  } else if constexpr (std::same_as<Told, std::int64_t>) {
    return "int64_t";
  } else if constexpr (std::same_as<Told, double>) {
    return "double";
  } else if constexpr (std::same_as<Told, std::string>) {
    return "string";
  } else {
    static_assert(!std::is_arithmetic_v<T>, "LCM has no such number");
    return "";
  }
}

// The fewest bytes of one.
template <class T>
constexpr std::size_t least_bytes() {
  if constexpr (std::is_arithmetic_v<T>) return sizeof(T);
  return std::same_as<T, std::string> ? 5 : 1;
}

template <class Form, class T>
using Told = std::decay_t<decltype(std::declval<const Form&>().told(std::declval<const T&>()))>;

class Writer {
 public:
  static constexpr bool kReads = false;
  explicit Writer(std::vector<std::uint8_t>& bytes) : bytes_(bytes), size_(bytes.size()) {}
  ~Writer() { bytes_.resize(size_); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  void operator()(const fields::Field& /*field*/, const auto& value) { put(value); }
  void operator()(const fields::Field& /*field*/, const auto& value, const auto& form) {
    put(form.told(value));
  }
  template <class List, class Form = fields::Same>
  void list(const fields::Field& /*count*/, const fields::Field& /*field*/, const List& list,
            const Form& form = {}) {
    put(static_cast<std::int32_t>(list.size()));
    for (const auto& element : list) put(form.told(element));
  }
  static void set(const auto& /*member*/, const auto& /*value*/) {}
  static void require(bool /*condition*/) {}

  // None of the texts contains a NUL: LCM's texts end there.
  bool good() const { return good_; }

 private:
  template <class T>
  void put(const T& value) {
    if constexpr (std::same_as<T, bool>) {
      *more(1) = value ? 1 : 0;
    } else if constexpr (std::same_as<T, double>) {
      put(std::bit_cast<std::uint64_t>(value));
    } else if constexpr (std::integral<T>) {
      std::uint8_t* const told = more(sizeof(T));
      std::uint64_t bits = std::make_unsigned_t<T>(value);
      for (std::size_t i = sizeof(T); i-- > 0; bits >>= 8)
        told[i] = static_cast<std::uint8_t>(bits);
    } else if constexpr (std::same_as<T, std::string>) {
      put(static_cast<std::int32_t>(value.size() + 1));
      std::memcpy(more(value.size() + 1), value.c_str(), value.size() + 1);
      good_ = good_ && value.find('\0') == std::string::npos;
    } else {
      T::fields(value, *this);
    }
  }

  // Where the next ones go.
  std::uint8_t* more(std::size_t count) {
    if (bytes_.size() - size_ < count) bytes_.resize(kFirstBytes + 2 * bytes_.size() + count);
    return bytes_.data() + std::exchange(size_, size_ + count);
  }

  static constexpr std::size_t kFirstBytes = 512;
  std::vector<std::uint8_t>& bytes_;  // longer than what has been written, until this ends
  std::size_t size_;
  bool good_ = true;
};

// Once something is wrong it stays so, and nothing is left to be read.
class Reader {
 public:
  static constexpr bool kReads = true;
  explicit Reader(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  void operator()(const fields::Field& /*field*/, auto& value) { get(value); }
  template <class T, class Form>
  void operator()(const fields::Field& /*field*/, T& value, const Form& form) {
    take(value, form);
  }
  template <class T, class Form = fields::Same>
  void list(const fields::Field& /*count*/, const fields::Field& /*field*/, std::vector<T>& list,
            const Form& form = {}) {
    const std::size_t count = get_count(least_bytes<Told<Form, T>>());
    list.clear();
    for (std::size_t i = 0; good_ && i < count; ++i) take(list.emplace_back(), form);
  }
  void set(auto& member, auto value) { member = std::move(value); }
  void require(bool condition) {
    if (!condition) fail_here();
  }

  bool good() const { return good_; }
  bool at_end() const { return rest_.empty(); }

 private:
  void fail_here() {
    good_ = false;
    rest_ = {};
  }
  template <class T, class Form>
  void take(T& value, const Form& form) {
    Told<Form, T> told{};
    get(told);
    if (good_ && !form.taken(std::move(told), value)) fail_here();
  }
  // So many elements of so many bytes at least may be left. A negative count is far too large.
  std::size_t get_count(std::size_t least_bytes) {
    std::int32_t told = 0;
    get(told);
    const std::size_t count = static_cast<std::uint32_t>(told);
    require(count <= rest_.size() / least_bytes);
    return good_ ? count : 0;
  }
  template <class T>
  void get(T& value) {
    if constexpr (std::same_as<T, bool>) {
      std::int8_t told = 0;
      get(told);
      value = told != 0;
    } else if constexpr (std::same_as<T, double>) {
      std::uint64_t bits = 0;
      get(bits);
      value = std::bit_cast<double>(bits);
    } else if constexpr (std::integral<T>) {
      value = 0;
      if (rest_.size() < sizeof(T)) return fail_here();
      std::make_unsigned_t<T> bits = 0;
      for (std::size_t i = 0; i < sizeof(T); ++i) {
        bits = static_cast<std::make_unsigned_t<T>>(std::uint64_t{bits} << 8 | rest_[i]);
      }
      value = static_cast<T>(bits);
      rest_ = rest_.subspan(sizeof(T));
    } else if constexpr (std::same_as<T, std::string>) {
      const std::size_t length = get_count(1);
      if (!good_ || length == 0) return fail_here();
      const void* nul = std::memchr(rest_.data(), 0, length);
      if (nul != rest_.data() + length - 1) return fail_here();
      value.assign(reinterpret_cast<const char*>(rest_.data()), length - 1);
      rest_ = rest_.subspan(length);
    } else {
      T::fields(value, *this);
    }
  }

  std::span<const std::uint8_t> rest_;
  bool good_ = true;
};

// As lcm-gen computes it: of the names of the fields, the names of their types where these are
// primitive, and their dimensions; and of the fingerprints of types within.
class Fingerprint {
 public:
  static constexpr bool kReads = false;
  template <class T>
  static std::uint64_t of() {
    const T message{};
    Fingerprint own;
    T::fields(message, own);
    return std::rotl(own.hash_ + own.within_, 1);
  }

  template <class T>
  void operator()(const fields::Field& field, const T& /*value*/) {
    add_field<T>(field.name);
    add('\0');  // dimensions
  }
  template <class T, class Form>
  void operator()(const fields::Field& field, const T& /*value*/, const Form& /*form*/) {
    add_field<Told<Form, T>>(field.name);
    add('\0');
  }
  template <class T, class Form = fields::Same>
  void list(const fields::Field& count, const fields::Field& field, const std::vector<T>& /*list*/,
            const Form& /*form*/ = {}) {
    counted_by(count.name);
    array<Told<Form, T>>(count.name, field.name);
  }
  static void set(const auto& /*member*/, const auto& /*value*/) {}
  static void require(bool /*condition*/) {}

 private:
  void add(char c) {
    const auto signed_hash = static_cast<std::int64_t>(hash_);
    hash_ = (hash_ << 8 ^ static_cast<std::uint64_t>(signed_hash >> 55)) +
            static_cast<std::uint64_t>(static_cast<signed char>(c));
  }
  void add(std::string_view text) {
    add(static_cast<char>(text.size()));
    for (const char c : text) add(c);
  }
  template <class T>
  void add_field(std::string_view name) {
    add(name);
    if constexpr (type_name<T>().empty()) {
      within_ += of<T>();
    } else {
      add(type_name<T>());
    }
  }
  void counted_by(std::string_view count) {
    add_field<std::int32_t>(count);
    add('\0');
  }
  template <class T>
  void array(std::string_view count, std::string_view name) {
    add_field<T>(name);
    add('\1');  // dimension,
    add('\1');  // of variable size
    add(count);
  }

  std::uint64_t hash_ = 0x12345678;
  std::uint64_t within_ = 0;
};

}  // namespace wire

// A message that refers to what it tells has a `Value` that owns the same.
template <class T>
std::uint64_t fingerprint() {
  if constexpr (requires { requires !std::same_as<T, typename T::Value>; }) {
    return fingerprint<typename T::Value>();
  } else {
    static const std::uint64_t fingerprint = wire::Fingerprint::of<T>();
    return fingerprint;
  }
}

// The bytes to publish. Fails when the message is longer than kMaxMessageBytes, and when a text
// contains a NUL; `channel` names it in the error.
Result<std::vector<std::uint8_t>> checked(std::string_view channel, std::vector<std::uint8_t> bytes,
                                          bool good);
template <class T>
std::vector<std::uint8_t> bytes_of(const T& message, bool& good) {
  std::vector<std::uint8_t> bytes;
  {
    wire::Writer writer(bytes);
    writer("fingerprint", fingerprint<T>());
    T::fields(message, writer);
    good = writer.good();
  }
  return bytes;
}
template <class T>
Result<std::vector<std::uint8_t>> encode(std::string_view channel, const T& message) {
  bool good = true;
  auto bytes = bytes_of(message, good);
  return checked(channel, std::move(bytes), good);
}

// The fingerprint is read.
template <class T>
bool begins(wire::Reader& reader) {
  std::uint64_t told = 0;
  reader("fingerprint", told);
  return reader.good() && told == fingerprint<T>();
}

// Nothing for a payload that is not exactly one message of type T: other fingerprint, truncated,
// bytes left over, a length beyond the end, a text without its NUL at the end or with one before, a
// value that means nothing. Memory needed is a small multiple of the payload. Throws nothing but
// std::bad_alloc.
template <class T>
std::optional<T> decode(std::span<const std::uint8_t> payload) {
  if (payload.size() > kMaxMessageBytes) return std::nullopt;
  wire::Reader reader(payload);
  if (!begins<T>(reader)) return std::nullopt;
  T message{};
  T::fields(message, reader);
  if (!reader.good() || !reader.at_end()) return std::nullopt;
  return message;
}

// What a message of type T begins with, of which it is not known whether the rest is good.
template <class T, class First>
std::optional<First> decode_first(std::span<const std::uint8_t> payload) {
  wire::Reader reader(payload);
  if (!begins<T>(reader)) return std::nullopt;
  First first{};
  First::fields(first, reader);
  return reader.good() ? std::optional(first) : std::nullopt;
}

}  // namespace bushd::lcm
