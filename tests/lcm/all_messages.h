// Every message, and the type that lcm-gen makes of its .lcm file.
#pragma once

#include <tuple>
#include <type_traits>
#include <variant>

#include "lcm/messages.h"
#include "lcm/oracle_types.h"
#include "lcm/type_name.h"

namespace bushd::test {

template <class MessageType>
struct Pair {
  using Message = MessageType;
  using Oracle = typename OracleNamed<kTypeName<MessageType>>::Type;
};

template <class... Client, class... Daemon, class... Content>
std::tuple<Pair<Daemon>..., Pair<Client>..., Pair<lcm::RequestMessage<Content>>...> pairs_of(
    const std::tuple<lcm::On<Daemon>...>& of_daemon,
    const std::tuple<lcm::On<Client>...>& of_clients, const std::variant<Content...>* requests);

// The fuzzers' corpus counts them in this order: a new request is the last one.
using AllMessages = decltype(pairs_of(lcm::kOfDaemon, lcm::kOfClients,
                                      static_cast<const api::Request::variant*>(nullptr)));

}  // namespace bushd::test
