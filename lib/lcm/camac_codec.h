// CAMAC cycles and what a crate answers, as messages; nothing for others.
#pragma once

#include <optional>
#include <span>

#include "api/reply.h"
#include "api/request.h"
#include "lcm/types.h"

namespace bushd::lcm {

camac_request_t to_message(const api::Camac& camac);
std::optional<api::Camac> camac_of(const camac_request_t& message);

// All but the responses, and some of them.
void put(camac_reply_t& answer, const api::CamacResult& result);
void put(camac_reply_t& answer, std::span<const camac::Response> responses);
api::CamacResult result_of(const camac_reply_t& message);

}  // namespace bushd::lcm
