#include "mail.h"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

namespace bushfaults {
namespace {

using bushd::sim::TimeNs;

constexpr TimeNs kMs = 1'000'000;

}  // namespace

void Mail::remember(const Request& request) {
  if (sent_.size() == kRemembered) sent_.pop_front();
  sent_.push_back({clients_.generation(), request});
}

void Mail::send(TimeNs now_ns, const Request& request) {
  const TimeNs delay_ns = std::exchange(delay_ns_, 0);
  if (delay_ns == 0) {
    remember(request);
    host_.request(now_ns, request);
  } else {
    letters_.push_back({now_ns + delay_ns, request});
  }
}

std::string Mail::delay_next(bushd::sim::Random& random) {
  delay_ns_ = random.magnitude(kMs, 10'000 * kMs);
  return fmt::format("by {} ms", delay_ns_ / kMs);
}

std::string Mail::repeat(TimeNs now_ns, bushd::sim::Random& random, bool stale) {
  std::vector<const Request*> candidates;
  for (const Sent& sent : sent_) {
    if ((sent.daemon != clients_.generation()) == stale) candidates.push_back(&sent.request);
  }
  if (candidates.empty()) return "(there is none)";
  const Request& request = *random.pick(candidates);
  host_.request(now_ns, request);
  return text_of(request);
}

std::string Mail::repeat(TimeNs now_ns, bushd::sim::Random& random) {
  return repeat(now_ns, random, false);
}

std::string Mail::repeat_stale(TimeNs now_ns, bushd::sim::Random& random) {
  return repeat(now_ns, random, true);
}

std::string Mail::flood(TimeNs now_ns, bushd::sim::Random& random, std::int64_t clients) {
  const std::int64_t requests = random.magnitude(50, 2'000);
  const std::int64_t of = random.magnitude(clients / 100 + 1, clients);
  for (std::int64_t n = 0; n < requests; ++n) {
    host_.request(now_ns, clients_.one_of_flood(static_cast<std::size_t>(n % of)));
  }
  return fmt::format("of {} requests by {} clients", requests, std::min(of, requests));
}

void Mail::run(TimeNs now_ns) {
  const auto due = [now_ns](const Letter& letter) { return letter.due_ns <= now_ns; };
  for (const Letter& letter : letters_) {
    if (!due(letter)) continue;
    remember(letter.request);
    host_.request(now_ns, letter.request);
  }
  std::erase_if(letters_, due);
}

TimeNs Mail::quiet_ns() const {
  TimeNs latest_ns = 0;
  for (const Letter& letter : letters_) latest_ns = std::max(latest_ns, letter.due_ns);
  return latest_ns;
}

}  // namespace bushfaults
