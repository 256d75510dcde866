// The page's web server, over sockets as anybody could open them: its own page is answered, nobody else.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>

#include "view/http_server.hpp"

namespace raypager {
namespace {

// A connection that says what it is told to, byte by byte.
class Client {
public:
    explicit Client(uint16_t port) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
        sockaddr_in place = {};
        place.sin_family = AF_INET;
        place.sin_port = htons(port);
        place.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        connected_ = ::connect(socket_, reinterpret_cast<const sockaddr*>(&place), sizeof place) == 0;
    }
    ~Client() { ::close(socket_); }
    Client(const Client&) = delete;
    Client& operator=(const Client&) = delete;

    // Whoever is refused before all is said may find the connection closed.
    void say(std::string_view text) const {
        while (!text.empty()) {
            const ssize_t sent = ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL);
            if (sent <= 0) return;
            text.remove_prefix(static_cast<size_t>(sent));
        }
    }
    // Until it is closed, or nothing comes for so long.
    std::string hear(int milliseconds = 2000) {
        std::string heard;
        pollfd ready = {socket_, POLLIN, 0};
        char bytes[4096];
        while (::poll(&ready, 1, milliseconds) > 0) {
            const ssize_t got = ::recv(socket_, bytes, sizeof bytes, 0);
            closed_ = got <= 0;
            if (closed_) break;
            heard.append(bytes, static_cast<size_t>(got));
        }
        return heard;
    }
    bool connected() const { return connected_; }
    bool closed() const { return closed_; }

private:
    int socket_;
    bool connected_ = false, closed_ = false;
};

class ViewServer : public testing::Test {
protected:
    void SetUp() override {
        auto started = HttpServer::start(0, [this](HttpRequest request, HttpServer::Respond respond) {
            const std::lock_guard lock(mutex_);
            asked_.push_back(request);
            if (request.name == "later")
                later_.push_back(respond);
            else
                respond({200, "text/plain", "hello"});
        });
        ASSERT_TRUE(started.ok()) << started.status().message();
        server_ = std::move(*started);
        const std::string url = server_->url();
        token_ = url.substr(url.find('/', 7));  // "/TOKEN/"
        own_ = fmt::format("Host: 127.0.0.1:{}\r\n", server_->port());
    }

    // The first line of the answer; empty if there is none.
    std::string answer(const std::string& request, int milliseconds = 2000) const {
        Client client(server_->port());
        client.say(request);
        const std::string heard = client.hear(milliseconds);
        return heard.substr(0, heard.find("\r\n"));
    }
    std::string get(const std::string& target, const std::string& headers) const {
        return answer("GET " + target + " HTTP/1.1\r\n" + headers + "Connection: close\r\n\r\n");
    }
    size_t asked() {
        const std::lock_guard lock(mutex_);
        return asked_.size();
    }

    std::mutex mutex_;
    std::vector<HttpRequest> asked_;
    std::vector<HttpServer::Respond> later_;
    std::unique_ptr<HttpServer> server_;
    std::string token_, own_;
};

TEST_F(ViewServer, answers_its_own_page) {
    Client client(server_->port());
    client.say("GET " + token_ + "picture?after=3&x=%41 HTTP/1.1\r\n" + own_ + fmt::format("Origin: http://127.0.0.1:{}\r\n", server_->port()) +
               "Sec-Fetch-Site: same-origin\r\nConnection: close\r\n\r\n");
    const std::string heard = client.hear();
    EXPECT_TRUE(heard.starts_with("HTTP/1.1 200 OK\r\n")) << heard;
    EXPECT_TRUE(heard.ends_with("\r\n\r\nhello")) << heard;
    for (const char* header : {"Content-Security-Policy: default-src 'none'", "X-Content-Type-Options: nosniff", "Cache-Control: no-store"})
        EXPECT_NE(heard.find(header), std::string::npos) << heard;
    ASSERT_EQ(asked(), 1u);
    EXPECT_EQ(asked_[0].name, "picture");
    EXPECT_FALSE(asked_[0].post);
    EXPECT_EQ(asked_[0].query.at("after"), "3");
    EXPECT_EQ(get(token_, fmt::format("Host: LocalHost:{}\r\n", server_->port())), "HTTP/1.1 200 OK");
}

TEST_F(ViewServer, answers_nobody_from_elsewhere) {
    const uint16_t port = server_->port();
    const std::string refused[] = {
        "",
        "Host: 127.0.0.1\r\n",
        fmt::format("Host: 127.0.0.1:{}\r\n", port == 1 ? 2 : port - 1),
        fmt::format("Host: example.com:{}\r\n", port),
        fmt::format("Host: 127.0.0.1.example.com:{}\r\n", port),
        fmt::format("Host: 127.0.0.1:{0}@example.com:{0}\r\n", port),
        own_ + own_,
        own_ + "Origin: null\r\n",
        own_ + "Origin: http://example.com\r\n",
        own_ + fmt::format("Origin: https://127.0.0.1:{}\r\n", port),
        own_ + fmt::format("Origin: http://localhost:{}\r\n", port),  // not the page that this host serves
        own_ + fmt::format("Origin: http://127.0.0.1:{0}\r\nOrigin: http://127.0.0.1:{0}\r\n", port),
        own_ + "Sec-Fetch-Site: cross-site\r\n",
        own_ + "Sec-Fetch-Site: same-site\r\n",
    };
    for (const std::string& headers : refused) EXPECT_EQ(get(token_, headers), "HTTP/1.1 403 Forbidden") << headers;
    EXPECT_EQ(asked(), 0u);
}

TEST_F(ViewServer, has_nothing_for_who_does_not_know_the_token) {
    std::string wrong = token_;
    wrong[5] = wrong[5] == '0' ? '1' : '0';
    const std::string targets[] = {"/",
                                   "/favicon.ico",
                                   wrong,
                                   token_.substr(0, token_.size() - 1),
                                   "//",
                                   token_ + "../../etc/passwd",
                                   token_ + "..%2f..%2fetc/passwd",
                                   token_ + "/etc/passwd",
                                   token_ + "a\\b",
                                   "http://127.0.0.1" + token_,
                                   "*"};
    for (const std::string& target : targets) EXPECT_EQ(get(target, own_), "HTTP/1.1 404 Not Found") << target;
    EXPECT_EQ(asked(), 0u);
}

TEST_F(ViewServer, takes_commands_as_json_alone) {
    const auto post = [&](const std::string& headers, const std::string& body) {
        return answer("POST " + token_ + "camera HTTP/1.1\r\n" + own_ + headers +
                      fmt::format("Content-Length: {}\r\nConnection: close\r\n\r\n", body.size()) + body);
    };
    EXPECT_EQ(post("Content-Type: application/json\r\n", "{}"), "HTTP/1.1 200 OK");
    ASSERT_EQ(asked(), 1u);
    EXPECT_TRUE(asked_[0].post);
    EXPECT_EQ(asked_[0].body, "{}");
    EXPECT_EQ(post("", "{}"), "HTTP/1.1 415 Unsupported Media Type");
    EXPECT_EQ(post("Content-Type: text/plain\r\n", "{}"), "HTTP/1.1 415 Unsupported Media Type");
    EXPECT_EQ(post("Content-Type: application/x-www-form-urlencoded\r\n", "a=b"), "HTTP/1.1 415 Unsupported Media Type");
    EXPECT_EQ(answer("PUT " + token_ + " HTTP/1.1\r\n" + own_ + "Content-Length: 0\r\nConnection: close\r\n\r\n"), "HTTP/1.1 405 Method Not Allowed");
    EXPECT_EQ(asked(), 1u);
}

TEST_F(ViewServer, reads_no_more_than_a_page_has_to_say) {
    const std::string begin = "POST " + token_ + "camera HTTP/1.1\r\n" + own_ + "Content-Type: application/json\r\n";
    EXPECT_EQ(answer(begin + "Content-Length: 1000000000000\r\n\r\n"), "HTTP/1.1 413 Payload Too Large");
    EXPECT_EQ(answer(begin + "Content-Length: 99999999999999999999999999\r\n\r\n"), "HTTP/1.1 400 Bad Request");
    std::string chunks = begin + "Transfer-Encoding: chunked\r\n\r\n";
    for (int i = 0; i < 40; i++) chunks += "400\r\n" + std::string(1024, 'x') + "\r\n";
    EXPECT_EQ(answer(chunks), "HTTP/1.1 413 Payload Too Large");
    EXPECT_EQ(answer(begin + "X: " + std::string(HttpServer::max_header_bytes, 'x') + "\r\n\r\n"), "HTTP/1.1 413 Payload Too Large");
    EXPECT_EQ(answer("\x16\x03\x01\x02\x00 garbage \xff\xfe\r\n\r\n"), "HTTP/1.1 400 Bad Request");
    EXPECT_EQ(answer(std::string(100000, '\0'), 500).substr(0, 12), "HTTP/1.1 400");
    EXPECT_EQ(asked(), 0u);
    EXPECT_EQ(get(token_, own_), "HTTP/1.1 200 OK");  // still there
}

// Those who open connections and say nothing do not keep others from being answered, up to a number of them.
TEST_F(ViewServer, lets_nobody_wait_for_the_slow) {
    std::vector<std::unique_ptr<Client>> slow;
    for (int i = 0; i + 1 < HttpServer::max_connections; i++) {
        slow.push_back(std::make_unique<Client>(server_->port()));
        ASSERT_TRUE(slow.back()->connected());
        slow.back()->say(i % 2 ? "GET " + token_ : "G");
    }
    EXPECT_EQ(get(token_, own_), "HTTP/1.1 200 OK");
    std::this_thread::sleep_for(std::chrono::milliseconds(50));  // until the one before has gone
    slow.push_back(std::make_unique<Client>(server_->port()));
    slow.back()->say("G");
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    Client surplus(server_->port());
    surplus.hear(2000);
    EXPECT_TRUE(surplus.closed());
    slow.clear();
    const auto begin = std::chrono::steady_clock::now();
    while (get(token_, own_) != "HTTP/1.1 200 OK") ASSERT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20));
}

TEST_F(ViewServer, waits_for_answers_from_other_threads) {
    Client client(server_->port());
    client.say("GET " + token_ + "later HTTP/1.1\r\n" + own_ + "\r\n");
    const auto begin = std::chrono::steady_clock::now();
    while (asked() == 0) ASSERT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20));
    std::thread([&] {
        const std::lock_guard lock(mutex_);
        later_[0]({503, "text/plain", "late", {{"X-Word", "w"}}});
        later_.clear();
    }).join();
    const std::string heard = client.hear(500);
    EXPECT_TRUE(heard.starts_with("HTTP/1.1 503")) << heard;
    EXPECT_NE(heard.find("X-Word: w"), std::string::npos) << heard;
    EXPECT_FALSE(client.closed());  // it may ask for more
    client.say("GET " + token_ + " HTTP/1.1\r\n" + own_ + "\r\n");
    EXPECT_TRUE(client.hear(500).starts_with("HTTP/1.1 200"));
}

TEST_F(ViewServer, ends_whoever_still_waits) {
    Client client(server_->port());
    client.say("GET " + token_ + "later HTTP/1.1\r\n" + own_ + "\r\n");
    Client half(server_->port());
    half.say("GET ");
    const auto begin = std::chrono::steady_clock::now();
    while (asked() == 0) ASSERT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20));
    server_.reset();
    client.hear(20000);
    half.hear(20000);
    EXPECT_TRUE(client.closed());
    EXPECT_TRUE(half.closed());
    const std::lock_guard lock(mutex_);
    later_[0]({200, "text/plain", "too late"});  // nobody hears it
    later_.clear();
}

// Some connections are always just being accepted then.
TEST_F(ViewServer, ends_while_others_knock) {
    std::atomic<uint16_t> port{server_->port()};
    const std::jthread knocking([&port](const std::stop_token& enough) {
        while (!enough.stop_requested()) Client client(port);
    });
    for (int i = 0; i < 50; i++) {
        server_.reset();  // which hung, once
        auto next = HttpServer::start(0, [](HttpRequest, HttpServer::Respond) {});
        ASSERT_TRUE(next.ok()) << next.status().message();
        server_ = std::move(*next);
        port = server_->port();
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
}

// One who does not know the address gets one answer for each connection.
TEST_F(ViewServer, strangers_do_not_keep_connections) {
    Client stranger(server_->port());
    stranger.say("GET /0/ HTTP/1.1\r\n" + own_ + "\r\n");
    EXPECT_TRUE(stranger.hear(5000).starts_with("HTTP/1.1 404"));
    EXPECT_TRUE(stranger.closed());
}

TEST_F(ViewServer, a_port_that_is_taken_is_an_error) {
    const auto second = HttpServer::start(server_->port(), [](HttpRequest, HttpServer::Respond) {});
    ASSERT_FALSE(second.ok());
    EXPECT_NE(second.status().message().find(fmt::format("port {} of 127.0.0.1", server_->port())), std::string::npos) << second.status().message();
    EXPECT_NE(second.status().message().find("--port"), std::string::npos);
}

TEST_F(ViewServer, is_at_another_address_each_time) {
    const auto second = HttpServer::start(0, [](HttpRequest, HttpServer::Respond) {});
    ASSERT_TRUE(second.ok());
    const std::string other = (*second)->url();
    EXPECT_EQ(token_.size(), 34u);
    EXPECT_NE(other.substr(other.find('/', 7)), token_);
}

}  // namespace
}  // namespace raypager
