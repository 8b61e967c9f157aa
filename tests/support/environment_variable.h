// Changes a variable of the environment in tests.
#pragma once

#include <cstdlib>
#include <optional>
#include <string>
#include <utility>

namespace halflight::test {

/// Sets a variable, or removes it for std::nullopt, and restores its previous state at the end of its lifetime.
class EnvironmentVariable {
  public:
    EnvironmentVariable(std::string name, const std::optional<std::string>& value) : name_(std::move(name)) {
        if (const char* before = std::getenv(name_.c_str())) before_ = before;
        set(value);
    }
    EnvironmentVariable(const EnvironmentVariable&) = delete;
    EnvironmentVariable& operator=(const EnvironmentVariable&) = delete;
    ~EnvironmentVariable() { set(before_); }

    void set(const std::optional<std::string>& value) const {
        value ? setenv(name_.c_str(), value->c_str(), 1) : unsetenv(name_.c_str());
    }

  private:
    const std::string name_;
    std::optional<std::string> before_;
};

}  // namespace halflight::test
