#include "server.h"

#include <fmt/format.h>
#include <libwebsockets.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <exception>
#include <iterator>
#include <utility>
#include <vector>

#include "base/printable.h"

namespace bushweb {
namespace {

constexpr const char* kPageProtocol = "bushd";
constexpr const char* kPollerProtocol = "bushd-poller";
constexpr const char* kRemoteProtocol = "bushd-remote";  // the name on this side
constexpr std::size_t kHeaderBytes = 8192;               // of an answer, and of a request
constexpr std::size_t kChunk = 32 * 1024;
constexpr unsigned kHandshakeSeconds = 5;
constexpr int kIdleSeconds = 15;  // of a connection that has been answered

// Nothing runs that is not a file of ours, and nobody frames the page.
constexpr std::array<std::pair<const char*, const char*>, 5> kHeaders{
    {{"content-security-policy:",
      "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src "
      "'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"},
     {"x-content-type-options:", "nosniff"},
     {"x-frame-options:", "DENY"},
     {"referrer-policy:", "no-referrer"},
     {"cross-origin-resource-policy:", "same-origin"}}};

std::int64_t steady_us() {
  const auto since = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(since).count();
}

std::string header(lws* wsi, lws_token_indexes token) {
  const int length = lws_hdr_total_length(wsi, token);
  if (length <= 0) return "";
  std::string text(static_cast<std::size_t>(length) + 1, '\0');
  const int copied = lws_hdr_copy(wsi, text.data(), static_cast<int>(text.size()), token);
  text.resize(copied > 0 ? static_cast<std::size_t>(copied) : 0);
  return text;
}

// The value of one argument of a path: "daemon=NAME".
std::string argument(lws* wsi, std::string_view name) {
  std::array<char, 512> part{};
  for (int i = 0;
       lws_hdr_copy_fragment(wsi, part.data(), part.size(), WSI_TOKEN_HTTP_URI_ARGS, i) >= 0; ++i) {
    const std::string_view text(part.data());
    if (text.starts_with(name) && text.substr(name.size()).starts_with('=')) {
      return std::string(text.substr(name.size() + 1));
    }
  }
  return "";
}

std::string method_of(lws* wsi) {
  if (lws_hdr_total_length(wsi, WSI_TOKEN_GET_URI) > 0) return "GET";
  return lws_hdr_total_length(wsi, WSI_TOKEN_POST_URI) > 0 ? "POST" : "another";
}

Visit visit_of(lws* wsi, std::string path) {
  std::array<char, 64> peer{};
  lws_get_peer_simple(wsi, peer.data(), peer.size());
  return {
      .method = method_of(wsi),
      .path = std::move(path),
      .daemon = argument(wsi, "daemon"),
      .host = header(wsi, WSI_TOKEN_HOST),
      .origin = header(wsi, WSI_TOKEN_ORIGIN),
      .cookies = header(wsi, WSI_TOKEN_HTTP_COOKIE),
      .peer = peer.data(),
      .takes_gzip = header(wsi, WSI_TOKEN_HTTP_ACCEPT_ENCODING).find("gzip") != std::string::npos};
}

const unsigned char* bytes_of(const std::string& text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}

int on_library_event(lws* wsi, lws_callback_reasons reason, void* /*user*/, void* in,
                     std::size_t length) {
  auto* server = static_cast<Server*>(lws_context_user(lws_get_context(wsi)));
  if (server == nullptr) return 0;
  // A length does not always belong to a text.
  const bool has_text = reason == LWS_CALLBACK_HTTP || reason == LWS_CALLBACK_HTTP_BODY ||
                        reason == LWS_CALLBACK_RECEIVE || reason == LWS_CALLBACK_CLIENT_RECEIVE ||
                        (reason == LWS_CALLBACK_CLIENT_CONNECTION_ERROR && in != nullptr);
  const std::string_view text =
      has_text ? std::string_view(static_cast<const char*>(in), length) : std::string_view();
  // Nothing may pass through the library, which is C. One connection ends, and nobody else's.
  try {
    return server->on_event(wsi, static_cast<int>(reason), text);
  } catch (const std::exception& fault) {
    fmt::print(stderr, "bushd-web: a connection is closed: {}\n", bushd::printable(fault.what()));
    return reason == LWS_CALLBACK_RAW_RX_FILE ? 0 : -1;  // that one is ours
  }
}

const std::array<lws_protocols, 5> kProtocols{
    {{"http-only", on_library_event, 0, 0, 0, nullptr, 0},
     {kPageProtocol, on_library_event, 0, 16 * 1024, 0, nullptr, 0},
     {kPollerProtocol, on_library_event, 0, 0, 0, nullptr, 0},
     {kRemoteProtocol, on_library_event, 0, 64 * 1024, 0, nullptr, 0},
     {nullptr, nullptr, 0, 0, 0, nullptr, 0}}};

void log_line(int /*level*/, const char* line) {
  fmt::print(stderr, "bushd-web: {}", line);
}

}  // namespace

Server::~Server() {
  if (context_ != nullptr) lws_context_destroy(context_);
}

bushd::Result<void> Server::open(const ServerOptions& options) {
  lws_set_log_level(LLL_ERR, log_line);
  lws_context_creation_info info{};
  info.port = CONTEXT_PORT_NO_LISTEN;
  info.user = this;
  info.options = LWS_SERVER_OPTION_EXPLICIT_VHOSTS;
  info.options |= LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT;  // for TLS of either side
  info.timeout_secs = kHandshakeSeconds;
  info.max_http_header_data2 = kHeaderBytes;
  info.max_http_header_pool2 = kMostConnections;
  context_ = lws_create_context(&info);
  if (context_ == nullptr) return bushd::fail("libwebsockets could not begin");

  lws_context_creation_info host{};
  host.port = options.port;
  host.iface = options.address.c_str();
  host.protocols = kProtocols.data();
  host.vhost_name = "bushd";
  host.options = info.options | LWS_SERVER_OPTION_FAIL_UPON_UNABLE_TO_BIND;
  if (options.address.find(':') == std::string::npos) {
    host.options |= LWS_SERVER_OPTION_DISABLE_IPV6;
  }
  host.timeout_secs = kHandshakeSeconds;
  host.keepalive_timeout = kIdleSeconds;
  host.alpn = "http/1.1";
  if (!options.certificate.empty()) {
    host.ssl_cert_filepath = options.certificate.c_str();
    host.ssl_private_key_filepath = options.key.c_str();
  }
  vhost_ = lws_create_vhost(context_, &host);
  if (vhost_ == nullptr) {
    return bushd::fail(fmt::format(
        "nothing can listen at {}:{}: the port is taken, the address is not of this PC, or the "
        "files of TLS cannot be used; --listen names another",
        options.address, options.port));
  }
  lws_sock_file_fd_type fd{};
  fd.filefd = ::dup(poller_.fd());  // the library closes it
  if (lws_adopt_descriptor_vhost(vhost_, LWS_ADOPT_RAW_FILE_DESC, fd, kPollerProtocol, nullptr) ==
      nullptr) {
    return bushd::fail("libwebsockets does not wait for descriptors of ours");
  }
  return {};
}

bool Server::run(Site& site) {
  site_ = &site;
  int result = 0;
  while (!ended_ && result >= 0) result = lws_service(context_, 0);
  site_ = nullptr;
  return ended_;
}

int Server::on_event(lws* wsi, int reason, std::string_view in) {
  switch (reason) {
    case LWS_CALLBACK_FILTER_NETWORK_CONNECTION:
      return connections_.size() >= kMostConnections ? 1 : 0;
    case LWS_CALLBACK_WSI_CREATE:
      connections_.insert(wsi);
      return 0;
    case LWS_CALLBACK_WSI_DESTROY:  // also of a connection to another bushd-web that never was
      connections_.erase(wsi);
      exchanges_.erase(wsi);
      upgrading_.erase(wsi);
      return 0;
    case LWS_CALLBACK_RAW_RX_FILE:
      poller_.handle();
      return 0;
    default:
      break;
  }
  if (site_ == nullptr) return 0;
  switch (reason) {
    case LWS_CALLBACK_CLIENT_ESTABLISHED:
    case LWS_CALLBACK_CLIENT_RECEIVE:
    case LWS_CALLBACK_CLIENT_CONNECTION_ERROR:
    case LWS_CALLBACK_CLIENT_CLOSED:
      return on_remote_event(wsi, reason, in);
    case LWS_CALLBACK_HTTP:
      return on_http(wsi, in);
    case LWS_CALLBACK_HTTP_BODY:
      return on_body(wsi, in);
    case LWS_CALLBACK_HTTP_BODY_COMPLETION:
      return begin_answer(wsi);
    case LWS_CALLBACK_HTTP_WRITEABLE:
      return write_body(wsi);
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION:
      return on_upgrade(wsi);
    case LWS_CALLBACK_ESTABLISHED: {
      const PageId id = ++last_page_;
      ids_[wsi] = id;
      pages_[id].wsi = wsi;
      site_->open(id, upgrading_[wsi]);
      upgrading_.erase(wsi);
      return 0;
    }
    case LWS_CALLBACK_RECEIVE:
      return on_message(wsi, in);
    case LWS_CALLBACK_SERVER_WRITEABLE:
      return write_text(wsi);
    case LWS_CALLBACK_CLOSED:
      on_page_closed(wsi);
      return 0;
    default:
      return 0;
  }
}

int Server::on_http(lws* wsi, std::string_view path) {
  Exchange& exchange = exchanges_[wsi];
  exchange = Exchange();
  exchange.visit = visit_of(wsi, std::string(path));
  const std::string told = header(wsi, WSI_TOKEN_HTTP_CONTENT_LENGTH);
  std::size_t length = 0;
  const auto read = std::from_chars(told.data(), told.data() + told.size(), length);
  const bool readable = told.empty() || read.ec == std::errc{};
  if (exchange.visit.method == "POST" && readable && length <= kMostBody && length > 0) return 0;
  // A body that nobody has asked for would be answered again when it comes.
  const bool bare = told.empty() && header(wsi, WSI_TOKEN_HTTP_TRANSFER_ENCODING).empty();
  exchange.close = exchange.visit.method != "GET" || !bare;
  if (exchange.visit.method == "GET" && !bare) exchange.visit.method = "GET with a body";
  return begin_answer(wsi);
}

int Server::on_body(lws* wsi, std::string_view bytes) {
  std::string& body = exchanges_[wsi].visit.body;
  if (body.size() + bytes.size() > kMostBody) return -1;
  body += bytes;
  return 0;
}

int Server::begin_answer(lws* wsi) {
  Exchange& exchange = exchanges_[wsi];
  if (std::exchange(exchange.begun, true)) return 0;  // a body that nobody has waited for has ended
  exchange.answer = site_->answer(exchange.visit);
  const Answer& answer = exchange.answer;
  std::vector<unsigned char> space(LWS_PRE + kHeaderBytes);
  unsigned char* const begin = space.data() + LWS_PRE;
  unsigned char* const end = space.data() + space.size();
  unsigned char* at = begin;
  const auto add = [&](const std::string& name, const std::string& value) {
    return lws_add_http_header_by_name(wsi, reinterpret_cast<const unsigned char*>(name.c_str()),
                                       bytes_of(value), static_cast<int>(value.size()), &at,
                                       end) == 0;
  };
  const std::size_t length = answer.body ? answer.body->size() : 0;
  bool good = lws_add_http_header_status(wsi, static_cast<unsigned>(answer.status), &at, end) == 0;
  good = good && add("content-type:", answer.type);
  for (const auto& [name, value] : kHeaders) good = good && add(name, value);
  for (const auto& [name, value] : answer.headers) good = good && add(name + ":", value);
  good = good && lws_add_http_header_content_length(wsi, length, &at, end) == 0;
  if (!good || lws_finalize_write_http_header(wsi, begin, &at, end) != 0) return -1;
  lws_callback_on_writable(wsi);
  return 0;
}

int Server::write_body(lws* wsi) {
  const auto found = exchanges_.find(wsi);
  if (found == exchanges_.end() || !found->second.answer.body) return 0;
  Exchange& exchange = found->second;
  const std::string& body = *exchange.answer.body;
  const std::size_t length = std::min(kChunk, body.size() - exchange.sent);
  const bool last = exchange.sent + length == body.size();
  std::vector<unsigned char> space(LWS_PRE + length);
  std::copy_n(body.data() + exchange.sent, length, space.data() + LWS_PRE);
  if (lws_write(wsi, space.data() + LWS_PRE, length, last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) <
      0) {
    return -1;
  }
  exchange.sent += length;
  if (!last) {
    lws_callback_on_writable(wsi);
    return 0;
  }
  const bool close = exchange.close;
  exchanges_.erase(found);
  return close || lws_http_transaction_completed(wsi) != 0 ? -1 : 0;
}

int Server::on_upgrade(lws* wsi) {
  const lws_protocols* protocol = lws_get_protocol(wsi);
  Visit visit = visit_of(wsi, header(wsi, WSI_TOKEN_GET_URI));
  const bool ours = protocol != nullptr && std::string_view(protocol->name) == kPageProtocol;
  const std::size_t most = site_->is_preferred(visit) ? kMostPages : kMostPages - kKeptPages;
  const bool full = pages_.size() >= most;
  const std::string why = !ours  ? "pages speak the protocol \"bushd\""
                          : full ? "too many pages are open"
                                 : site_->why_no_page(visit);
  if (why.empty()) {
    upgrading_[wsi] = std::move(visit);
    return 0;
  }
  lws_return_http_status(wsi, full ? 503 : 403, why.c_str());
  return 1;
}

int Server::on_message(lws* wsi, std::string_view bytes) {
  const auto id = ids_.find(wsi);
  if (id == ids_.end() || lws_frame_is_binary(wsi) != 0) return -1;
  std::string& heard = pages_[id->second].heard;
  if (heard.size() + bytes.size() > kMostMessage) return -1;
  heard += bytes;
  if (lws_remaining_packet_payload(wsi) > 0 || lws_is_final_fragment(wsi) == 0) return 0;
  const std::string text = std::exchange(heard, "");
  site_->hear(id->second, text);
  return 0;
}

void Server::send(PageId page, const Text& text) {
  const auto found = pages_.find(page);
  if (found == pages_.end()) return;
  OpenPage& to = found->second;
  if (to.unsent.empty()) to.waits_since_us = steady_us();
  to.unsent.push_back(text);
  to.bytes += text->size();
  lws_callback_on_writable(to.wsi);
}

bool Server::is_behind(PageId page) const {
  const auto found = pages_.find(page);
  return found != pages_.end() && found->second.bytes > kBehind;
}

int Server::write_text(lws* wsi) {
  const auto id = ids_.find(wsi);
  if (id == ids_.end()) return -1;
  OpenPage& page = pages_[id->second];
  if (page.unsent.empty()) return 0;
  const Text text = page.unsent.front();
  page.unsent.pop_front();
  page.bytes -= text->size();
  page.waits_since_us = steady_us();
  std::vector<unsigned char> space(LWS_PRE + text->size());
  std::ranges::copy(*text, space.data() + LWS_PRE);
  if (lws_write(wsi, space.data() + LWS_PRE, text->size(), LWS_WRITE_TEXT) < 0) return -1;
  if (!page.unsent.empty()) lws_callback_on_writable(wsi);
  return 0;
}

void Server::close_deaf() {
  const std::int64_t now_us = steady_us();
  for (auto& [id, page] : pages_) {
    const bool deaf = !page.unsent.empty() && now_us - page.waits_since_us > kDeafUs;
    if (deaf || page.bytes > kMostUnsent) {
      lws_set_timeout(page.wsi, PENDING_TIMEOUT_USER_REASON_BASE, LWS_TO_KILL_ASYNC);
    }
  }
}

// The library would look the name up while everybody waits.
void Server::dial(Remote& remote) {
  lookup_.start(remote.name().host, [this, &remote](const bushd::Result<std::string>& address) {
    if (site_ == nullptr) return;  // `remote` is the site's
    if (!address) return remote.on_end(address.error().text());
    connect(remote, *address);
  });
}

void Server::connect(Remote& remote, const std::string& address) {
  const RemoteName& name = remote.name();
  const std::string host = fmt::format("{}:{}", name.host, name.port);
  lws* wsi = nullptr;
  lws_client_connect_info info{};
  info.context = context_;
  info.vhost = vhost_;
  info.address = address.c_str();
  info.port = name.port;
  info.ssl_connection = name.tls ? LCCSCF_USE_SSL : 0;
  info.path = "/api/live";
  info.host = host.c_str();
  info.protocol = kPageProtocol;
  info.local_protocol_name = kRemoteProtocol;
  info.alpn = "http/1.1";
  info.pwsi = &wsi;
  // Events of a connection that fails at once come before this returns.
  dialled_ = &remote;
  if (lws_client_connect_via_info(&info) != nullptr && wsi != nullptr) {
    remotes_[wsi].remote = &remote;
  } else if (std::exchange(dialled_, nullptr) != nullptr) {
    remote.on_end("there is no connection");
  }
  dialled_ = nullptr;
}

int Server::on_remote_event(lws* wsi, int reason, std::string_view in) {
  const auto found = remotes_.find(wsi);
  if (found == remotes_.end()) {
    if (reason == LWS_CALLBACK_CLIENT_CONNECTION_ERROR && dialled_ != nullptr) {
      std::exchange(dialled_, nullptr)->on_end(std::string(in));
    }
    return 0;
  }
  Far& far = found->second;
  switch (reason) {
    case LWS_CALLBACK_CLIENT_ESTABLISHED:
      far.remote->on_open();
      return 0;
    case LWS_CALLBACK_CLIENT_RECEIVE:
      if (far.heard.size() + in.size() > Remote::kMostMessage) return -1;
      far.heard += in;
      if (lws_remaining_packet_payload(wsi) == 0 && lws_is_final_fragment(wsi) != 0) {
        far.remote->on_text(std::exchange(far.heard, ""));
      }
      return 0;
    default: {
      Remote* remote = far.remote;
      remotes_.erase(found);
      remote->on_end(in.empty() ? "the connection has ended" : std::string(in));
      return 0;
    }
  }
}

void Server::close_silent() {
  for (const auto& [wsi, far] : remotes_) {
    if (far.remote->is_silent()) {
      lws_set_timeout(wsi, PENDING_TIMEOUT_USER_REASON_BASE, LWS_TO_KILL_ASYNC);
    }
  }
}

void Server::on_page_closed(lws* wsi) {
  const auto id = ids_.find(wsi);
  if (id == ids_.end()) return;
  pages_.erase(id->second);
  site_->close(id->second);
  ids_.erase(id);
}

}  // namespace bushweb
