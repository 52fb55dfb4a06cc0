#include "lcm/snapshot.h"

#include <utility>

namespace bushd::lcm {

template <class Whole, class Part>
std::optional<Whole> Collector<Whole, Part>::add(Part part) {
  if (part.parts < 1 || part.parts > kMaxParts || part.part < 0 || part.part >= part.parts) {
    return std::nullopt;
  }
  if (collected_.empty() || part.sequence != sequence_ || part.parts != parts_) {
    collected_.clear();
    sequence_ = part.sequence;
    parts_ = part.parts;
  }
  const std::int32_t index = part.part;
  collected_.insert_or_assign(index, std::move(part));
  if (collected_.size() != static_cast<std::size_t>(parts_)) return std::nullopt;
  std::vector<Part> all;
  for (auto& [at, one] : collected_) all.push_back(std::move(one));
  collected_.clear();
  return Whole{sequence_, std::move(all)};
}

template class Collector<Snapshot, state_t>;
template class Collector<Health, health_t>;

}  // namespace bushd::lcm
