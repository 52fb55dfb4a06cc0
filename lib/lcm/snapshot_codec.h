// The pieces of the codec that its files share; nothing for others.
#pragma once

#include "bushd/table_ref_t.hpp"
#include "lcm/codec.h"

namespace bushd::lcm {

table_ref_t message_of(const api::TableRef& table);
api::TableRef ref_of(const table_ref_t& message);

std::optional<DaemonMessage> decode_answer(Payload payload);
std::optional<DaemonMessage> decode_table_answer(Payload payload);
std::optional<DaemonMessage> decode_history_answer(Payload payload);
std::optional<DaemonMessage> decode_configuration_answer(Payload payload);
std::optional<DaemonMessage> decode_camac_answer(Payload payload);
std::optional<DaemonMessage> decode_welcome(Payload payload);

}  // namespace bushd::lcm
