#include "config/key_places.h"

#include <algorithm>

#include "tables/toml_reader.h"

namespace bushd::config {

KeyPlaces::KeyPlaces(const tables::TomlReader& section,
                     std::initializer_list<std::string_view> keys) {
  places_.reserve(keys.size());
  for (const std::string_view key : keys) {
    places_.push_back({key, section.has(key), section.error(key, "")});
  }
}

Error KeyPlaces::at(std::string_view key) const {
  const auto found = std::ranges::find(places_, key, &Place::key);
  return found == places_.end() ? Error{} : found->error;
}

bool KeyPlaces::written(std::string_view key) const {
  const auto found = std::ranges::find(places_, key, &Place::key);
  return found != places_.end() && found->written;
}

}  // namespace bushd::config
