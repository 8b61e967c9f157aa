// Ray queries of Embree 3 and 4, whose interfaces differ. All else that this project calls is equal in both.
#pragma once

#ifndef HALFLIGHT_EMBREE
#error "HALFLIGHT_EMBREE is not the version of Embree that CMake has found; both may be installed"
#endif
#if HALFLIGHT_EMBREE >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <type_traits>

namespace halflight::embree {

#if HALFLIGHT_EMBREE >= 4
using Context = RTCRayQueryContext;
inline constexpr RTCSceneFlags kQueriesFilter = RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS;
#else
using Context = RTCIntersectContext;
inline constexpr RTCSceneFlags kQueriesFilter = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;
#endif

/// Arguments of a ray query besides the scene and the rays. Embree passes the address of the object to `filter` as the
/// context.
struct Query {
    Context context{};
    RTCFilterFunctionN filter = nullptr;  // decides on candidate hits; needs a scene with kQueriesFilter
    bool coherent = false;                // a hint: the rays of a packet are similar

    /// Calls rtcIntersect1, rtcOccluded1, or the function of packets of 8 or 16 rays. `valid`: per ray, -1 or 0 to
    /// leave it out; for packets only.
    template <auto kFunction, class Rays, class... Valid>
    void trace(RTCScene scene, Rays* rays, Valid... valid) {
#if HALFLIGHT_EMBREE >= 4
        constexpr bool kCloses =
            std::is_invocable_v<decltype(kFunction), Valid..., RTCScene, Rays*, RTCIntersectArguments*>;
        std::conditional_t<kCloses, RTCIntersectArguments, RTCOccludedArguments> arguments;
        if constexpr (kCloses)
            rtcInitIntersectArguments(&arguments);
        else
            rtcInitOccludedArguments(&arguments);
        rtcInitRayQueryContext(&context);
        int flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
        if (filter) flags |= RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER;
        arguments.flags = static_cast<RTCRayQueryFlags>(flags);
        arguments.context = &context;
        arguments.filter = filter;
        kFunction(valid..., scene, rays, &arguments);
#else
        rtcInitIntersectContext(&context);
        context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
        context.filter = filter;
        kFunction(valid..., scene, &context, rays);
#endif
    }
};

}  // namespace halflight::embree
