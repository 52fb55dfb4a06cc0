#include "lcm/snapshot.h"

#include <utility>

namespace bushd::lcm {

std::optional<Snapshot> SnapshotCollector::add(state_t part) {
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
  Snapshot snapshot{.sequence = sequence_, .mcus = {}};
  for (auto& [at, state] : collected_) snapshot.mcus.push_back(std::move(state));
  collected_.clear();
  return snapshot;
}

}  // namespace bushd::lcm
