// Buffers mapped to the memory of the process.
#pragma once

#include <cstddef>

#include "engine/gpu/buffer.h"

namespace halflight::gpu {

/// Returns whether the driver of the current context renders on the processor.
bool renders_on_processor();

/// A mapped buffer, for the lifetime of the object; no GL command may use the buffer meanwhile. Only drivers that
/// render on the processor map buffers of this project: there the contents lie in the process's memory anyway.
class Mapping {
  public:
    enum class Access { read, write };

    /// Waits for the commands that use the buffer, and maps it. Throws Error if the driver does not map it.
    Mapping(const Buffer& buffer, Access access);
    Mapping(const Mapping&) = delete;
    Mapping& operator=(const Mapping&) = delete;
    ~Mapping();

    template <class T>
    T* as() const {
        return static_cast<T*>(data_);
    }

  private:
    GLuint id_;
    void* data_;
};

}  // namespace halflight::gpu
