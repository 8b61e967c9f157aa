// Checks refusals of invalid input.
#pragma once

#include <gtest/gtest.h>

#include "tests/support/error_message.h"

namespace halflight {

/// Expects that f throws an Error whose message is one line, begins with `subject` and names `element`.
template <class F>
void expect_refusal(F&& f, const std::string& element, const std::string& subject = "") {
    const std::string message = error_message(f);
    EXPECT_NE(message, "") << element << " was accepted";
    EXPECT_TRUE(message.starts_with(subject)) << message << " does not begin with " << subject;
    EXPECT_NE(message.find(element), std::string::npos) << message << " does not name " << element;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

}  // namespace halflight
