// What a reply brings.
#pragma once

#include <variant>

#include "api/reply.h"
#include "base/result.h"

namespace bushd::client {

// Null where it is another one, or none.
template <class Detail>
const Detail* detail_of(const api::Reply& reply) {
  const auto* completed = std::get_if<api::Completed>(&reply);
  return completed == nullptr ? nullptr : std::get_if<Detail>(&completed->detail);
}
template <class Detail>
const Detail* detail_of(const Result<api::Reply>& reply) {
  return reply ? detail_of<Detail>(*reply) : nullptr;
}

}  // namespace bushd::client
