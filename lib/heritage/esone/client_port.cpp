#include <chrono>
#include <memory>
#include <thread>
#include <variant>

#include "client/answer.h"
#include "client/client.h"
#include "heritage/esone/port.h"

namespace bushd::esone {
namespace {

class ClientPort final : public Port {
 public:
  tl::expected<api::CamacResult, Failure> run(int crate, const camac::Block& block) override {
    if (!client_) {
      auto client = client::Client::open({.program = "esone"});
      if (!client) return no(kNoDaemon, client.error().text());
      client_ = std::move(*client);
    }
    const auto reply =
        client_->run(api::Camac{.crate = crate, .block = block}, client::Client::Until::kResult);
    if (!reply) {
      client_.reset();  // the next call finds another daemon
      return no(kTransport, reply.error().text());
    }
    if (const auto* refused = std::get_if<api::Refused>(&*reply)) {
      return no(kNoCrate, refused->reason);
    }
    const auto* result = client::detail_of<api::CamacResult>(reply);
    if (result == nullptr) return no(kTransport, "the daemon's answer is none of a crate");
    return *result;
  }
  std::int64_t now_ms() override {
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    return std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
  }
  void pause_ms(std::int64_t length_ms) override {
    std::this_thread::sleep_for(std::chrono::milliseconds(length_ms));
  }

 private:
  static tl::unexpected<Failure> no(Code code, std::string text) {
    return tl::unexpected<Failure>(Failure{code, std::move(text)});
  }

  std::unique_ptr<client::Client> client_;
};

}  // namespace

Port& client_port() {
  static ClientPort port;
  return port;
}

}  // namespace bushd::esone
