// SPDX-License-Identifier: Apache-2.0
#include "device/status/page_server.h"

#include <fmt/format.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstring>
#include <deque>
#include <list>
#include <mutex>

#include "common/error.h"
#include "device/status/listen_socket.h"
#include "device/status/status_page.h"

namespace mf {

namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr std::size_t request_memory = 32 * 1024;  // of a connection: the headers must fit
constexpr std::size_t event_block = 16 * 1024;
constexpr std::size_t longest_patience = 64 * 1024;  // a body that goes on beyond this is cut off
constexpr std::chrono::milliseconds preview_each{250};

struct ResponseDeleter {
  void operator()(MHD_Response* response) const { MHD_destroy_response(response); }
};
using Response = std::unique_ptr<MHD_Response, ResponseDeleter>;

void add_headers(const Response& response, const char* content_type) {
  const std::string policy = fmt::format(
      "default-src 'none'; script-src '{}'; style-src '{}'; connect-src 'self'; img-src 'self'; base-uri 'none'; "
      "form-action 'none'; frame-ancestors 'none'",
      status_page_script_source(), status_page_style_source());
  const std::pair<const char*, const char*> headers[] = {
      {"Content-Type", content_type},        {"Content-Security-Policy", policy.c_str()},
      {"X-Content-Type-Options", "nosniff"}, {"X-Frame-Options", "DENY"},
      {"Referrer-Policy", "no-referrer"},    {"Cross-Origin-Resource-Policy", "same-origin"},
      {"Cache-Control", "no-store"}};
  for (const auto& [name, value] : headers) MHD_add_response_header(response.get(), name, value);
}

Response text_response(std::string_view text, const char* content_type) {
  Response response(
      MHD_create_response_from_buffer(text.size(), const_cast<char*>(text.data()), MHD_RESPMEM_MUST_COPY));
  if (response) add_headers(response, content_type);
  return response;
}

MHD_Result answer(MHD_Connection* connection, int code, const Response& response) {
  return response ? MHD_queue_response(connection, static_cast<unsigned>(code), response.get()) : MHD_NO;
}

MHD_Result answer_text(MHD_Connection* connection, int code, std::string_view line) {
  return answer(connection, code, text_response(std::string(line) + "\n", "text/plain; charset=utf-8"));
}

MHD_Result answer_refusal(MHD_Connection* connection, const PageDecision& decision) {
  const Response response = text_response(std::string(decision.reason) + "\n", "text/plain; charset=utf-8");
  if (response && !decision.allow.empty())
    MHD_add_response_header(response.get(), "Allow", std::string(decision.allow).c_str());
  return answer(connection, decision.code, response);
}

std::optional<std::string_view> header(MHD_Connection* connection, const char* name) {
  const char* value = nullptr;
  std::size_t size = 0;
  const MHD_Result found =
      MHD_lookup_connection_value_n(connection, MHD_HEADER_KIND, name, std::strlen(name), &value, &size);
  if (found != MHD_YES || value == nullptr) return std::nullopt;
  return std::string_view(value, size);
}

PageRequest request_of(MHD_Connection* connection, const char* path, const char* method) {
  return {method,
          path,
          header(connection, MHD_HTTP_HEADER_HOST),
          header(connection, MHD_HTTP_HEADER_ORIGIN),
          header(connection, MHD_HTTP_HEADER_CONTENT_TYPE),
          header(connection, MHD_HTTP_HEADER_CONTENT_LENGTH),
          {}};
}

}  // namespace

struct PageServer::Server {
  // A browser that listens to /events.
  struct Listener {
    Server* server = nullptr;
    MHD_Connection* connection = nullptr;
    bool sleeps = false;                                   // suspended until there is news
    std::deque<std::shared_ptr<const std::string>> texts;  // on their way: at most a status and a picture
    std::size_t sent = 0;                                  // of the first
    std::uint64_t number = 0, preview_number = 0;          // last taken
    SteadyClock::time_point next_preview;
  };

  Server(PageServerOptions, std::function<bool(const std::string&)>);
  ~Server();
  void publish(std::shared_ptr<const PageTexts>);

  MHD_Result begin(MHD_Connection*, const PageRequest&, void** state);
  MHD_Result finish_start(MHD_Connection*, PageRequest, const std::string& body);
  MHD_Result listen_to_events(MHD_Connection*);
  ssize_t next_bytes(Listener&, char* into, std::size_t most);
  void choose_texts(Listener&) const;
  void wake_all();

  // MHD's callbacks; `server` and `listener` are what it was given to hand back.
  static MHD_Result on_request(void* server, MHD_Connection*, const char* path, const char* method, const char* version,
                               const char* data, std::size_t* size, void** state);
  static void on_completed(void* server, MHD_Connection*, void** state, MHD_RequestTerminationCode);
  static void on_connection(void* server, MHD_Connection*, void** state, MHD_ConnectionNotificationCode);
  static ssize_t on_more(void* listener, std::uint64_t position, char* into, std::size_t most);
  static void on_gone(void* listener);

  PageServerOptions options;
  std::function<bool(const std::string&)> start;
  AttemptLimit attempts;  // the server's thread's own
  int port = 0;
  MHD_Daemon* daemon = nullptr;

  std::mutex mutex;  // guards what follows
  std::shared_ptr<const PageTexts> texts;
  std::list<std::unique_ptr<Listener>> listeners;
  bool stopping = false;
};

PageServer::Server::Server(PageServerOptions o, std::function<bool(const std::string&)> on_start)
    : options(std::move(o)), start(std::move(on_start)) {
  OwnedFd listening = listen_socket(options.address, options.port);
  port = port_of(listening);
  constexpr unsigned flags = MHD_USE_EPOLL_INTERNAL_THREAD | MHD_ALLOW_SUSPEND_RESUME;
  daemon = MHD_start_daemon(flags, 0, nullptr, nullptr, on_request, this,                                         //
                            MHD_OPTION_LISTEN_SOCKET, listening.get(),                                            //
                            MHD_OPTION_CONNECTION_LIMIT, options.most_connections,                                //
                            MHD_OPTION_PER_IP_CONNECTION_LIMIT, options.most_connections_of_an_address,           //
                            MHD_OPTION_CONNECTION_TIMEOUT, static_cast<unsigned>(options.idle.count()),           //
                            MHD_OPTION_CONNECTION_MEMORY_LIMIT, request_memory, MHD_OPTION_STRICT_FOR_CLIENT, 1,  //
                            MHD_OPTION_NOTIFY_COMPLETED, on_completed, this,                                      //
                            MHD_OPTION_NOTIFY_CONNECTION, on_connection, this, MHD_OPTION_END);
  if (daemon == nullptr)
    throw InputError(fmt::format("{} port {}", options.address, port), "",
                     "cannot be served: is the limit of open files or threads reached?");
  (void)listening.release();  // MHD closes it
}

PageServer::Server::~Server() {
  {
    const std::scoped_lock hold(mutex);
    stopping = true;
    wake_all();  // MHD does not end while a connection is suspended
  }
  MHD_stop_daemon(daemon);
}

void PageServer::Server::wake_all() {
  for (const std::unique_ptr<Listener>& l : listeners)
    if (std::exchange(l->sleeps, false)) MHD_resume_connection(l->connection);
}

void PageServer::Server::publish(std::shared_ptr<const PageTexts> published) {
  const std::scoped_lock hold(mutex);
  texts = std::move(published);
  wake_all();
}

MHD_Result PageServer::Server::on_request(void* self, MHD_Connection* connection, const char* path, const char* method,
                                          const char* /*version*/, const char* data, std::size_t* size, void** state) {
  Server& server = *static_cast<Server*>(self);
  try {
    const PageRequest request = request_of(connection, path, method);
    if (*state == nullptr) return server.begin(connection, request, state);
    std::string& body = *static_cast<std::string*>(*state);
    if (*size == 0) return server.finish_start(connection, request, body);
    body.append(data, *size);
    *size = 0;
    return body.size() > longest_patience ? MHD_NO : MHD_YES;
  } catch (const std::exception&) {
    return MHD_NO;  // out of memory: this connection ends, the others go on
  }
}

MHD_Result PageServer::Server::begin(MHD_Connection* connection, const PageRequest& request, void** state) {
  const PageDecision decision = decide_on_head(request, options.rules);
  switch (decision.route) {
    case PageRoute::page:
      return answer(connection, MHD_HTTP_OK, text_response(status_page(), "text/html; charset=utf-8"));
    case PageRoute::icon:
      return answer(connection, MHD_HTTP_NO_CONTENT, text_response({}, "image/x-icon"));
    case PageRoute::status: {
      const std::scoped_lock hold(mutex);
      if (!texts) return answer_text(connection, MHD_HTTP_SERVICE_UNAVAILABLE, "Nothing is known yet.");
      return answer(connection, MHD_HTTP_OK, text_response(texts->status, "application/json"));
    }
    case PageRoute::events:
      return listen_to_events(connection);
    case PageRoute::start:
      *state = std::make_unique<std::string>().release();  // on_completed() deletes it
      return MHD_YES;
    case PageRoute::refused:
      break;
  }
  return answer_refusal(connection, decision);
}

MHD_Result PageServer::Server::finish_start(MHD_Connection* connection, PageRequest request, const std::string& body) {
  if (!attempts.take(AttemptLimit::Clock::now()))
    return answer_text(connection, MHD_HTTP_TOO_MANY_REQUESTS, "Too many attempts: wait some seconds.");
  request.body = body;
  const PageDecision decision = decide_on_start(request, options.rules);
  if (decision.route != PageRoute::start) return answer_refusal(connection, decision);
  if (!start(options.rules.token))
    return answer_text(connection, MHD_HTTP_SERVICE_UNAVAILABLE, "The recorder does not run.");
  return answer_text(connection, MHD_HTTP_ACCEPTED, "The rig was asked to start.");
}

void PageServer::Server::on_completed(void* /*self*/, MHD_Connection*, void** state, MHD_RequestTerminationCode) {
  const std::unique_ptr<std::string> body(static_cast<std::string*>(std::exchange(*state, nullptr)));
}

void PageServer::Server::on_connection(void* /*self*/, MHD_Connection* connection, void** /*state*/,
                                       MHD_ConnectionNotificationCode code) {
  if (code != MHD_CONNECTION_NOTIFY_STARTED) return;
  const MHD_ConnectionInfo* info = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
  if (info == nullptr) return;
  // A phone that went out of reach says nothing: what it does not acknowledge for so long ends the connection.
  const unsigned unacknowledged_ms = 15'000;
  (void)::setsockopt(info->connect_fd, IPPROTO_TCP, TCP_USER_TIMEOUT, &unacknowledged_ms, sizeof(unacknowledged_ms));
  // Over a slow radio old pictures would pile up in the kernel; this way they are skipped before they are sent.
  const int unsent_bytes = 32 * 1024;
  (void)::setsockopt(info->connect_fd, IPPROTO_TCP, TCP_NOTSENT_LOWAT, &unsent_bytes, sizeof(unsent_bytes));
}

MHD_Result PageServer::Server::listen_to_events(MHD_Connection* connection) {
  auto made = std::make_unique<Listener>();
  Listener* const listener = made.get();
  listener->server = this;
  listener->connection = connection;
  listener->texts.push_back(std::make_shared<const std::string>("retry: 1000\n\n"));
  {
    const std::scoped_lock hold(mutex);
    if (stopping || listeners.size() >= options.most_event_clients)
      return answer_text(connection, MHD_HTTP_SERVICE_UNAVAILABLE, "Too many browsers are listening.");
    listeners.push_back(std::move(made));
  }
  const Response response(MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, event_block, on_more, listener, on_gone));
  if (!response) on_gone(listener);
  if (response) add_headers(response, "text/event-stream");
  return answer(connection, MHD_HTTP_OK, response);
}

ssize_t PageServer::Server::on_more(void* listener, std::uint64_t /*position*/, char* into, std::size_t most) {
  Listener& l = *static_cast<Listener*>(listener);
  try {
    return l.server->next_bytes(l, into, most);
  } catch (const std::exception&) {
    return MHD_CONTENT_READER_END_WITH_ERROR;
  }
}

void PageServer::Server::on_gone(void* listener) {
  Server& server = *static_cast<Listener*>(listener)->server;
  const std::scoped_lock hold(server.mutex);
  std::erase_if(server.listeners, [&](const std::unique_ptr<Listener>& l) { return l.get() == listener; });
}

ssize_t PageServer::Server::next_bytes(Listener& listener, char* into, std::size_t most) {
  const std::scoped_lock hold(mutex);
  if (stopping) return MHD_CONTENT_READER_END_OF_STREAM;
  if (listener.texts.empty()) choose_texts(listener);
  if (listener.texts.empty()) {
    listener.sleeps = true;
    MHD_suspend_connection(listener.connection);
    return 0;
  }
  const std::string& text = *listener.texts.front();
  const std::size_t count = std::min(most, text.size() - listener.sent);
  std::memcpy(into, text.data() + listener.sent, count);
  listener.sent += count;
  if (listener.sent == text.size()) {
    listener.texts.pop_front();
    listener.sent = 0;
  }
  return static_cast<ssize_t>(count);
}

void PageServer::Server::choose_texts(Listener& listener) const {
  if (!texts || texts->number == listener.number) return;
  listener.number = texts->number;
  listener.texts.emplace_back(texts, &texts->status_event);  // kept alive with all the texts
  const auto now = SteadyClock::now();
  if (texts->preview_number == listener.preview_number || now < listener.next_preview) return;
  listener.preview_number = texts->preview_number;
  listener.next_preview = now + preview_each;
  listener.texts.push_back(texts->preview_event);
}

PageServer::PageServer(PageServerOptions options, std::function<bool(const std::string&)> start)
    : server_(std::make_unique<Server>(std::move(options), std::move(start))) {}
PageServer::~PageServer() = default;

int PageServer::port() const {
  return server_->port;
}

void PageServer::publish(std::shared_ptr<const PageTexts> texts) {
  server_->publish(std::move(texts));
}

}  // namespace mf
