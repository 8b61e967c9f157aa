// Returns messages of errors, for tests.
#pragma once

#include <string>

#include "engine/core/error.h"

namespace halflight {

/// Returns the message of the Error that f throws; empty if it throws none.
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
