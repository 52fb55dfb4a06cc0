#include "daemon/fronts/reception.h"

#include <algorithm>
#include <utility>

namespace bushd::daemon {

bool Reception::takes_more(const Client& client, std::size_t bytes) const {
  return client.waiting.size() < limits_.requests_per_client &&
         client.bytes + bytes <= limits_.bytes_per_client;
}

void Reception::take(api::Asker asker, api::Request request, std::size_t bytes,
                     const std::optional<Arrival>& arrival) {
  if (!asker.session->may_command()) {
    return asker.answer(api::Refused{"this client may not command; it may only listen"});
  }
  if (api::ends_motion(request)) {
    asker.after_stops = counted_.count();
    if (arrival) arrivals_.stopped(*arrival, asker.after_stops, now_us());
    return carry_out_(asker, request);
  }
  const std::uint64_t stops = counted_.stops();
  asker.after_stops = std::min(asker.after_stops,
                               arrival ? arrivals_.after_stops(*arrival, stops, now_us()) : stops);
  if (requests_ >= limits_.requests || bytes_ + bytes > limits_.bytes) {
    return asker.answer(
        api::Refused{"the daemon has " + std::to_string(requests_) +
                     " requests waiting and accepts no more now; try again in a moment"});
  }
  const std::string key = asker.session->text();
  const auto [client, first] = clients_.try_emplace(key);
  if (!takes_more(client->second, bytes)) {
    const std::size_t count = client->second.waiting.size();
    if (first) clients_.erase(client);
    return asker.answer(api::Refused{std::to_string(count) +
                                     " requests of this client wait already; wait for answers"});
  }
  if (first) turns_.push_back(key);
  client->second.waiting.push_back({std::move(asker), std::move(request), bytes});
  client->second.bytes += bytes;
  ++requests_;
  bytes_ += bytes;
}

void Reception::carry_out_next() {
  if (turns_.empty()) return;
  const auto client = clients_.find(turns_.front());
  const Waiting next = std::move(client->second.waiting.front());
  client->second.waiting.pop_front();
  client->second.bytes -= next.bytes;
  --requests_;
  bytes_ -= next.bytes;
  if (client->second.waiting.empty()) {
    clients_.erase(client);
    turns_.pop_front();
  } else {
    turns_.splice(turns_.end(), turns_, turns_.begin());
  }
  carry_out_(next.asker, next.request);
}

}  // namespace bushd::daemon
