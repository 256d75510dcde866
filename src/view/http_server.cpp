#include "view/http_server.hpp"

#include <fcntl.h>
#include <fmt/format.h>

#include <atomic>
#include <boost/asio/bind_executor.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include "view/request_check.hpp"

namespace raypager {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using Tcp = asio::ip::tcp;

// Scripts, styles and connections of this server alone; no other page may show this one inside of it.
constexpr const char* content_policy =
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' blob: data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'";

class Connection;

// Programs that are started, such as a browser, must not hold it.
void keep_from_children(int descriptor) { fcntl(descriptor, F_SETFD, FD_CLOEXEC); }

struct Shared {
    asio::io_context context{1};
    HttpServer::Handle handle;
    std::string token;
    uint16_t port = 0;
    std::atomic<bool> ended{false};
    std::mutex mutex;
    std::set<Connection*> connections;  // that there are; the last who knows one may be another thread, which had an answer for it
};

class Connection : public std::enable_shared_from_this<Connection> {
public:
    Connection(Tcp::socket socket, std::shared_ptr<Shared> shared) : shared_(std::move(shared)), stream_(std::move(socket)) {
        const std::lock_guard lock(shared_->mutex);
        shared_->connections.insert(this);
    }
    ~Connection() {
        const std::lock_guard lock(shared_->mutex);
        shared_->connections.erase(this);
    }
    Connection(const Connection&) = delete;
    Connection& operator=(const Connection&) = delete;

    // first: of the connection, which must come soon; others may keep the connection waiting.
    void read(bool first) {
        parser_.emplace();
        parser_->header_limit(HttpServer::max_header_bytes);
        parser_->body_limit(HttpServer::max_body_bytes);
        stream_.expires_after(std::chrono::seconds(first ? HttpServer::request_seconds : HttpServer::idle_seconds));
        http::async_read_header(stream_, buffer_, *parser_,
                                [self = shared_from_this()](beast::error_code error, size_t) { self->header_came(error); });
    }
    void close() {
        beast::error_code ignored;
        stream_.socket().shutdown(Tcp::socket::shutdown_both, ignored);
        stream_.close();
    }

private:
    void header_came(beast::error_code error) {
        if (error) return fail(error);
        if (!is_own(parser_->get())) return refuse(403, "this page is not for you");
        stream_.expires_after(std::chrono::seconds(HttpServer::request_seconds));
        http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](beast::error_code read, size_t) { self->request_came(read); });
    }

    // What was not understood is answered; who has gone, or says nothing, is left.
    void fail(beast::error_code error) {
        if (error == http::error::body_limit || error == http::error::header_limit) return refuse(413, "the request is too large");
        if (error.category() == http::make_error_code(http::error::bad_method).category() && error != http::error::end_of_stream &&
            error != http::error::partial_message)
            return refuse(400, "the request cannot be read");
        close();
    }

    // A header that is there twice is one that says something else to somebody.
    std::optional<std::string> only(const http::request<http::string_body>& request, beast::string_view name, bool& twice) const {
        if (request.count(name) > 1) twice = true;
        const auto found = request.find(name);
        if (found == request.end()) return std::nullopt;
        return std::string(found->value());
    }

    bool is_own(const http::request<http::string_body>& request) const {
        bool twice = false;
        const RequestOrigin from = {only(request, "Host", twice), only(request, "Origin", twice), only(request, "Sec-Fetch-Site", twice)};
        return !twice && is_from_own_page(from, shared_->port);
    }

    void request_came(beast::error_code error) {
        if (error) return fail(error);
        http::request<http::string_body> request = parser_->release();
        keep_alive_ = request.keep_alive();
        auto target = parse_target({request.target().data(), request.target().size()});
        if (!target || !same_token(target->token, shared_->token)) return refuse(404, "nothing here");
        const bool post = request.method() == http::verb::post;
        if (!post && request.method() != http::verb::get) return reply({405, "text/plain; charset=utf-8", "GET and POST alone"});
        // A form of another page cannot send this type without asking first.
        if (post && request[http::field::content_type] != "application/json")
            return reply({415, "text/plain; charset=utf-8", "commands are application/json"});
        stream_.expires_never();
        shared_->handle({post, std::move(target->name), std::move(target->query), std::move(request.body())},
                        [self = shared_from_this()](HttpReply answer) { respond(self, std::move(answer)); });
    }

    static void respond(const std::shared_ptr<Connection>& self, HttpReply answer) {
        if (self->shared_->ended) return;
        asio::post(self->shared_->context, [self, answer = std::move(answer)]() mutable { self->reply(std::move(answer)); });
    }

    void refuse(unsigned status, const char* why) {
        keep_alive_ = false;
        reply({status, "text/plain; charset=utf-8", why});
    }

    void reply(HttpReply answer) {
        response_.emplace(static_cast<http::status>(answer.status), 11);
        response_->set(http::field::content_type, answer.type);
        response_->set(http::field::cache_control, "no-store");
        response_->set("Content-Security-Policy", content_policy);
        response_->set("X-Content-Type-Options", "nosniff");
        response_->set("Referrer-Policy", "no-referrer");
        response_->set("Cross-Origin-Resource-Policy", "same-origin");
        for (const auto& [name, value] : answer.headers) response_->set(name, value);
        response_->keep_alive(keep_alive_);
        response_->body() = std::move(answer.body);
        response_->prepare_payload();
        stream_.expires_after(std::chrono::seconds(HttpServer::idle_seconds));
        http::async_write(stream_, *response_, [self = shared_from_this()](beast::error_code error, size_t) {
            if (error || !self->keep_alive_) return self->close();
            self->read(false);
        });
    }

    const std::shared_ptr<Shared> shared_;
    beast::tcp_stream stream_;
    beast::flat_buffer buffer_{HttpServer::max_header_bytes + HttpServer::max_body_bytes};
    std::optional<http::request_parser<http::string_body>> parser_;
    std::optional<http::response<http::string_body>> response_;
    bool keep_alive_ = false;
};

}  // namespace

HttpReply json_reply(std::string text, unsigned status) { return {status, "application/json", std::move(text)}; }

class HttpServer::Implementation {
public:
    Status start(uint16_t port, Handle handle) {
        beast::error_code error;
        const Tcp::endpoint place(asio::ip::address_v4::loopback(), port);
        acceptor_.open(place.protocol(), error);
        if (!error) acceptor_.set_option(asio::socket_base::reuse_address(true), error);
        if (!error) acceptor_.bind(place, error);
        if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
        if (!error) keep_from_children(acceptor_.native_handle());
        if (error) return Status::failed(fmt::format("port {} of 127.0.0.1: {}; give another --port, or none", port, error.message()));
        shared_->handle = std::move(handle);
        shared_->token = random_token();
        shared_->port = acceptor_.local_endpoint().port();
        accept();
        thread_ = std::thread([this] { shared_->context.run(); });
        return {};
    }
    ~Implementation() {
        if (!thread_.joinable()) return;
        asio::post(shared_->context, [this] {
            beast::error_code ignored;
            shared_->ended = true;
            acceptor_.close(ignored);
            retry_.cancel();
            for (const auto& connection : connections()) connection->close();
        });
        thread_.join();
    }
    uint16_t port() const { return shared_->port; }
    std::string url() const { return fmt::format("http://127.0.0.1:{}/{}/", port(), shared_->token); }

private:
    // But those that are about to go.
    std::vector<std::shared_ptr<Connection>> connections() const {
        std::vector<std::shared_ptr<Connection>> result;
        const std::lock_guard lock(shared_->mutex);
        for (Connection* connection : shared_->connections)
            if (auto held = connection->weak_from_this().lock()) result.push_back(std::move(held));
        return result;
    }
    void accept() {
        acceptor_.async_accept([this](beast::error_code error, Tcp::socket socket) {
            // It may have come just before the end, and be told of behind it.
            if (shared_->ended || error == asio::error::operation_aborted) return;
            if (!error) keep_from_children(socket.native_handle());
            if (!error && connections().size() < static_cast<size_t>(max_connections)) {
                beast::error_code ignored;
                socket.set_option(Tcp::no_delay(true), ignored);
                std::make_shared<Connection>(std::move(socket), shared_)->read(true);
            }
            if (!error) return accept();
            // No descriptors left, for instance: trying at once would only heat the room.
            retry_.expires_after(std::chrono::milliseconds(100));
            retry_.async_wait([this](beast::error_code cancelled) {
                if (!cancelled && !shared_->ended) accept();
            });
        });
    }

    std::shared_ptr<Shared> shared_ = std::make_shared<Shared>();
    Tcp::acceptor acceptor_{shared_->context};
    asio::steady_timer retry_{shared_->context};
    std::thread thread_;
};

Result<std::unique_ptr<HttpServer>> HttpServer::start(uint16_t port, Handle handle) {
    auto implementation = std::make_unique<Implementation>();
    RAYPAGER_TRY(implementation->start(port, std::move(handle)));
    return std::unique_ptr<HttpServer>(new HttpServer(std::move(implementation)));
}

HttpServer::HttpServer(std::unique_ptr<Implementation> implementation) : implementation_(std::move(implementation)) {}
HttpServer::~HttpServer() = default;
uint16_t HttpServer::port() const { return implementation_->port(); }
std::string HttpServer::url() const { return implementation_->url(); }

}  // namespace raypager
