#include "tests/cli/virtual_display.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>

namespace halflight::test {

VirtualDisplay::VirtualDisplay() {
    std::array<int, 2> number;
    if (pipe(number.data()) != 0) {
        why_not_ = "no pipe";
        return;
    }
    server_ = fork();
    if (server_ == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        close(number[0]);
        const int nowhere = open("/dev/null", O_RDWR);
        for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) dup2(nowhere, stream);
        const std::string fd = std::to_string(number[1]);
        execlp("Xvfb", "Xvfb", "-displayfd", fd.c_str(), "-screen", "0", "1280x1024x24", "-nolisten", "tcp", nullptr);
        _exit(127);
    }
    close(number[1]);
    // The server writes its number and a line end once it accepts connections.
    constexpr int kPatience = 60000;  // ms
    std::string text;
    pollfd end{number[0], POLLIN, 0};
    char letter = 0;
    while (!text.ends_with('\n') && poll(&end, 1, kPatience) == 1 && read(number[0], &letter, 1) == 1) text += letter;
    close(number[0]);
    if (text.ends_with('\n'))
        name_.append(":").append(text, 0, text.size() - 1);
    else
        why_not_ = "Xvfb cannot be started; Debian's package is xvfb";
}

VirtualDisplay::~VirtualDisplay() {
    if (server_ <= 0) return;
    kill(server_, SIGTERM);
    waitpid(server_, nullptr, 0);
}

}  // namespace halflight::test
