#include "tools/cli/signals.h"

#include <unistd.h>

#include <csignal>
#include <initializer_list>

namespace halflight {
namespace {

volatile std::sig_atomic_t received = 0;
volatile std::sig_atomic_t writing = 0;

extern "C" void on_stop_signal(int signal) {
    if (received && !writing) _exit(128 + signal);  // exit status like a shell's for death by signal
    received = signal;
}

}  // namespace

void handle_signals() {
    struct sigaction action {};
    action.sa_handler = on_stop_signal;
    action.sa_flags = SA_RESTART;  // interrupted system calls of libraries are restarted
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
        struct sigaction old {};
        sigaction(signal, nullptr, &old);
        if (old.sa_handler != SIG_IGN) sigaction(signal, &action, nullptr);  // keeps signals ignored, as nohup wants
    }
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
