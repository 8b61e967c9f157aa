// How the pages that a batch of rays needs are found. Hits do not depend on it. No OpenGL is used.
#pragma once

#include <cstdint>

#include "engine/core/names.h"

namespace halflight::paging {

enum class PageSchedule : std::uint8_t {
    demand,   // rays report the pages that they miss
    set,      // the pages that the batch used last time are loaded first
    queries,  // tiles of coherent rays query the hierarchy over all pages first; other batches follow their set
};
inline constexpr PageSchedule kPageSchedules[] = {PageSchedule::demand, PageSchedule::set, PageSchedule::queries};
inline constexpr PageSchedule kDefaultPageSchedule = PageSchedule::set;
inline const char* name(PageSchedule schedule) {
    return name_among(kPageSchedules, {"demand", "set", "queries"}, schedule);
}

}  // namespace halflight::paging
