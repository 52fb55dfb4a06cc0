#include "api/session.h"

#include <algorithm>

namespace bushd::api {
namespace {

constexpr std::size_t kMaxClientId = 64;

}  // namespace

bool is_client_id(std::string_view id) {
  return !id.empty() && id.size() <= kMaxClientId &&
         std::all_of(id.begin(), id.end(), [](unsigned char c) { return c > 0x20 && c < 0x7F; });
}

std::string Session::text() const {
  if (!credentials_) return client_id_;
  return client_id_ + " (uid " + std::to_string(credentials_->uid) + ", pid " +
         std::to_string(credentials_->pid) + ")";
}

bool Asker::is_same_client(const Asker& other) const {
  return session && other.session && session->transport() == other.session->transport() &&
         session->text() == other.session->text();
}

}  // namespace bushd::api
