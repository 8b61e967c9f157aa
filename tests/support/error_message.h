// What an Error says, for tests of messages.
#pragma once

#include <string>

#include "engine/core/error.h"

namespace halflight {

/// The message of the Error that f throws; empty if it throws none.
template <class F>
std::string error_message(F&& f) {
    try {
        f();
    } catch (const Error& error) {
        return error.what();
    }
    return "";
}

}  // namespace halflight
