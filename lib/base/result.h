// One way to fail on the host: Result<T>, with an Error that says where, what and what to do about
// it.
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace bushd {

struct Error {
  std::string message;  // cause and remedy, a full sentence without the place
  std::string file{};   // empty: not about a file
  int line = 0;         // 1-based; 0: unknown
  std::string key{};    // the key in the file, dotted path ("motor[3].output"); empty: none
  int column = 0;       // of `line`, 1-based, in characters; 0: unknown

  // "FILE:LINE:COLUMN: KEY: MESSAGE", leaving out what is unknown.
  std::string text() const {
    std::string out;
    if (!file.empty()) {
      out += file;
      if (line > 0) out += ":" + std::to_string(line);
      if (line > 0 && column > 0) out += ":" + std::to_string(column);
      out += ": ";
    }
    if (!key.empty()) out += key + ": ";
    return out + message;
  }
};

template <class T>
using Result = tl::expected<T, Error>;

inline tl::unexpected<Error> fail(std::string message) {
  return tl::unexpected<Error>(Error{.message = std::move(message)});
}
inline tl::unexpected<Error> fail(Error error) {
  return tl::unexpected<Error>(std::move(error));
}

}  // namespace bushd
