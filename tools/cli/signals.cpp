#include "tools/cli/signals.h"

#include <time.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdint>
#include <initializer_list>

namespace halflight {
namespace {

volatile std::sig_atomic_t received = 0;
volatile std::sig_atomic_t writing = 0;
std::atomic<std::int64_t> received_at = 0;  // CLOCK_MONOTONIC, ms
static_assert(decltype(received_at)::is_always_lock_free, "a signal handler uses it");

extern "C" void on_stop_signal(int signal) {
    // One request may come as two signals: timeout(1) sends them to the program and to its process group.
    constexpr std::int64_t kSameRequest = 500;  // ms
    timespec time{};
    clock_gettime(CLOCK_MONOTONIC, &time);
    const std::int64_t now = std::int64_t{time.tv_sec} * 1000 + time.tv_nsec / 1'000'000;
    if (!received) {
        received_at = now;
        received = signal;
    } else if (!writing && signal != SIGXCPU && now - received_at > kSameRequest) {
        _exit(128 + signal);  // exit status like a shell's for death by signal
    }
}

}  // namespace

void handle_signals() {
    struct sigaction action {};
    action.sa_handler = on_stop_signal;
    action.sa_flags = SA_RESTART;  // interrupted system calls of libraries are restarted
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGXCPU}) {
        struct sigaction old {};
        sigaction(signal, nullptr, &old);
        if (old.sa_handler != SIG_IGN) sigaction(signal, &action, nullptr);  // keeps signals ignored, as nohup wants
    }
    std::signal(SIGCHLD, SIG_DFL);  // if a parent has it ignored, no child could be waited for
    std::signal(SIGPIPE, SIG_IGN);  // a reader of messages that ends must not end a render
    std::signal(SIGXFSZ, SIG_IGN);  // beyond the limit of file sizes write() fails, and that is reported
}

int stop_signal() {
    return received;
}

WritingFiles::WritingFiles() {
    writing = 1;
}
WritingFiles::~WritingFiles() {
    writing = 0;
}

}  // namespace halflight
