#include "tests/cli/virtual_display.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <array>

#include "engine/core/error.h"

namespace halflight::test {

VirtualDisplay::VirtualDisplay() {
    std::array<int, 2> number;
    if (pipe2(number.data(), O_CLOEXEC) != 0) {
        why_not_ = "no pipe";
        return;
    }
    std::string text;
    try {
        // setpriv ends the server when this process ends in any way.
        server_.emplace(std::vector<std::string>{"setpriv", "--pdeathsig", "KILL", "Xvfb", "-displayfd", "1", "-screen",
                                                 "0", "1280x1024x24", "-nolisten", "tcp"},
                        ProcessOptions{.output = number[1]});
        close(number[1]);
        // The server writes its number and a line end once it accepts connections.
        constexpr int kPatience = 60000;  // ms
        pollfd end{number[0], POLLIN, 0};
        char letter = 0;
        while (!text.ends_with('\n') && poll(&end, 1, kPatience) == 1 && read(number[0], &letter, 1) == 1)
            text += letter;
    } catch (const Error&) {
        close(number[1]);
    }
    close(number[0]);
    if (text.ends_with('\n'))
        name_.append(":").append(text, 0, text.size() - 1);
    else
        why_not_ = "Xvfb cannot be started; Debian's package is xvfb";
}

VirtualDisplay::~VirtualDisplay() {
    if (!server_) return;
    kill(server_->id(), SIGTERM);  // on SIGTERM the server removes its lock
    server_->wait();
}

}  // namespace halflight::test
