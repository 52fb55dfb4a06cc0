#include "daemon/client_log.h"

#include <algorithm>

namespace bushd::daemon {
namespace {

constexpr std::size_t kMaxClientId = 64;

}  // namespace

bool valid_client_id(const std::string& id) {
  return !id.empty() && id.size() <= kMaxClientId &&
         std::all_of(id.begin(), id.end(), [](unsigned char c) { return c > 0x20 && c < 0x7F; });
}

ClientLog::Verdict ClientLog::note(const std::string& client_id, std::int64_t number) {
  const auto found = clients_.find(client_id);
  if (found == clients_.end() && clients_.size() >= kClients) {
    clients_.erase(std::min_element(
        clients_.begin(), clients_.end(),
        [](const auto& a, const auto& b) { return a.second.used < b.second.used; }));
  }
  const bool first = found == clients_.end();
  Client& client = clients_[client_id];
  client.used = ++uses_;
  if (client.answers.contains(number)) return Verdict::kRepeated;
  if (!first && number <= client.highest) return Verdict::kTooOld;
  client.highest = number;
  client.answers[number];
  if (client.answers.size() > kCommandsPerClient) client.answers.erase(client.answers.begin());
  return Verdict::kNew;
}

void ClientLog::record(const reply_t& reply) {
  const auto client = clients_.find(reply.client_id);
  if (client == clients_.end()) return;
  const auto answer = client->second.answers.find(reply.number);
  if (answer != client->second.answers.end()) answer->second.push_back(reply);
}

std::vector<reply_t> ClientLog::replies(const std::string& client_id, std::int64_t number) const {
  const auto client = clients_.find(client_id);
  if (client == clients_.end()) return {};
  const auto answer = client->second.answers.find(number);
  return answer == client->second.answers.end() ? std::vector<reply_t>{} : answer->second;
}

}  // namespace bushd::daemon
