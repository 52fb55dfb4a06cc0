#include "lcm/table_codec.h"

#include <limits>

#include "lcm/packet.h"

namespace bushd::lcm {
namespace {

// What a file cannot say becomes what it cannot say either: 0, which the check of a table names.
std::uint16_t code(std::int32_t value) {
  return value < 0 || value > std::numeric_limits<std::uint16_t>::max()
             ? std::uint16_t{0}
             : static_cast<std::uint16_t>(value);
}

std::vector<std::uint16_t> codes(const std::vector<std::int32_t>& values) {
  std::vector<std::uint16_t> out;
  out.reserve(values.size());
  for (const std::int32_t value : values) out.push_back(code(value));
  return out;
}

}  // namespace

tables::TableContent content_of(const table_t& message) {
  tables::TableContent content;
  content.name = message.name;
  content.description = message.description;
  content.revision = message.revision > 0 ? static_cast<std::uint32_t>(message.revision) : 0;
  if (message.time_unit_ns > 0 && message.time_unit_ns <= tables::kMaxTimeUnitNs) {
    content.time_unit_ns = static_cast<std::uint32_t>(message.time_unit_ns);
  }
  content.accel = codes(message.accel);
  if (!message.decel.empty()) content.decel = codes(message.decel);
  if (message.cruise != 0) content.cruise = code(message.cruise);
  return content;
}

table_t message_of(const tables::TableContent& content) {
  table_t message{};
  message.name = content.name;
  message.description = content.description;
  message.revision = static_cast<std::int32_t>(content.revision);
  // Of a content that is no table there is no hash.
  if (!tables::check(content)) message.hash = tables::content_hash(content);
  message.time_unit_ns = content.time_unit_ns;
  message.cruise = content.cruise.value_or(0);
  message.accel.assign(content.accel.begin(), content.accel.end());
  if (content.decel) message.decel.assign(content.decel->begin(), content.decel->end());
  message.accel_count = count(message.accel);
  message.decel_count = count(message.decel);
  return message;
}

}  // namespace bushd::lcm
