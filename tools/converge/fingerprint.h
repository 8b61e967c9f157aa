// What a reference is of, as a number: its file in the cache is found by it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "tools/converge/painter.h"

namespace halflight::converge {

/// FNV-1a of 64 bits (Fowler, Noll, Vo; IETF draft-eastlake-fnv): for telling inputs apart, not for safety.
class Hash {
  public:
    void add_bytes(const void* bytes, std::size_t count);
    /// Of types without padding.
    template <class T>
    requires std::has_unique_object_representations_v<T> || std::is_floating_point_v<T>
    void add(const T& value) { add_bytes(&value, sizeof(value)); }
    std::uint64_t value() const { return value_; }

  private:
    std::uint64_t value_ = 0xcbf29ce484222325;
};

/// Of all that decides the radiance of the scene's surfaces: geometry, materials, textures, lights, environment. Names
/// and reports are not part of it.
std::uint64_t scene_fingerprint(const Scene& scene);

/// Of the expected picture: scene, size, camera and bounces, and who makes it: the values of `probe`, a small picture
/// that the maker has made of the scene, change where its code changes what it makes.
std::uint64_t reference_fingerprint(std::uint64_t scene, const View& view, std::string_view maker,
                                    const Picture& probe);

}  // namespace halflight::converge
