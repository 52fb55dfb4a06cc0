#include "lcm/camac_codec.h"

#include <cstdint>

namespace bushd::lcm {

camac_request_t to_message(const api::Camac& camac) {
  camac_request_t message{};
  message.crate = camac.crate;
  message.mode = static_cast<std::int8_t>(static_cast<int>(camac.block.mode) + 1);
  message.count = static_cast<std::int32_t>(camac.block.count);
  message.last_station = camac.block.last_station;
  message.last_subaddress = camac.block.last_subaddress;
  for (const camac::Naf& naf : camac.block.cycles) {
    message.stations.push_back(static_cast<std::int8_t>(naf.station));
    message.subaddresses.push_back(static_cast<std::int8_t>(naf.subaddress));
    message.functions.push_back(static_cast<std::int8_t>(naf.function));
    message.data.push_back(static_cast<std::int32_t>(naf.data));
  }
  message.cycle_count = static_cast<std::int32_t>(camac.block.cycles.size());
  return message;
}
std::optional<api::Camac> camac_of(const camac_request_t& message) {
  if (message.mode < camac_request_t::SINGLE || message.mode > camac_request_t::SCAN) {
    return std::nullopt;
  }
  api::Camac camac{.crate = message.crate,
                   .block = {.mode = static_cast<camac::BlockMode>(message.mode - 1),
                             .count = static_cast<std::uint32_t>(message.count),
                             .last_station = message.last_station,
                             .last_subaddress = message.last_subaddress}};
  for (std::size_t i = 0; i < message.stations.size(); ++i) {
    camac.block.cycles.push_back({.station = message.stations[i],
                                  .subaddress = message.subaddresses[i],
                                  .function = message.functions[i],
                                  .data = static_cast<std::uint32_t>(message.data[i])});
  }
  return camac;
}

void put(camac_reply_t& answer, const api::CamacResult& result) {
  answer.tally = static_cast<std::int32_t>(result.block.tally);
  answer.requests = static_cast<std::int32_t>(result.requests);
}

void put(camac_reply_t& answer, std::span<const camac::Response> responses) {
  for (const auto& [x, q, data] : responses) {
    answer.x.push_back(x ? 1 : 0);
    answer.q.push_back(q ? 1 : 0);
    answer.data.push_back(static_cast<std::int32_t>(data));
  }
  answer.response_count = static_cast<std::int32_t>(responses.size());
}

api::CamacResult result_of(const camac_reply_t& message) {
  api::CamacResult result{.block = {.tally = static_cast<std::uint32_t>(message.tally)},
                          .requests = static_cast<std::uint32_t>(message.requests)};
  for (std::size_t i = 0; i < message.x.size(); ++i) {
    result.block.responses.push_back({.x = message.x[i] != 0,
                                      .q = message.q[i] != 0,
                                      .data = static_cast<std::uint32_t>(message.data[i])});
  }
  return result;
}

}  // namespace bushd::lcm
