// Starts an X server without a screen, for tests of windows.
#pragma once

#include <optional>
#include <string>

#include "engine/core/process.h"

namespace halflight::test {

/// An X server that runs as long as the object exists, and never longer than the process.
class VirtualDisplay {
  public:
    VirtualDisplay();
    VirtualDisplay(const VirtualDisplay&) = delete;
    VirtualDisplay& operator=(const VirtualDisplay&) = delete;
    ~VirtualDisplay();

    const std::string& name() const { return name_; }  ///< ":99"; empty if no server could be started
    const std::string& why_not() const { return why_not_; }

  private:
    std::optional<Process> server_;
    std::string name_;
    std::string why_not_;
};

}  // namespace halflight::test
