// Where keys of one section stand, for what is refused long after the file was read: by this PC
// (host_check.h), or by an MCU that has no room for something.
#pragma once

#include <initializer_list>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"

namespace bushd::tables {
class TomlReader;
}

namespace bushd::config {

class KeyPlaces {
 public:
  KeyPlaces() = default;
  // `keys` outlive it.
  KeyPlaces(const tables::TomlReader& section, std::initializer_list<std::string_view> keys);

  // An error there, without a message. A key that is not written has the place of its section.
  // Precondition: it is one of `keys`.
  Error at(std::string_view key) const;
  bool written(std::string_view key) const;

 private:
  struct Place {
    std::string_view key;
    bool written;
    Error error;
  };
  std::vector<Place> places_;
};

}  // namespace bushd::config
